// kiln plan IN: what a bake would model and what it would skip, and why.
#include <filesystem>

#include "client_cli/commands.h"
#include "client_cli/files.h"
#include "client_cli/models.h"
#include "client_cli/remote_bake.h"
#include "client_cli/report_text.h"
#include "core/bake/bake.h"

namespace kiln {
namespace {

std::string temporary_folder() {
  std::error_code error;
  return std::filesystem::temp_directory_path(error).string();
}

Outcome<std::string> plan_here(const PlanOptions& options, Session& session) {
  KILN_TRY(loaded, load_recipe(options.recipe, false));
  KILN_TRY(recipe, checked_recipe(loaded));
  KILN_TRY(files, load_files(options.input));
  Threads threads(recipe.limits.threads);
  const StopTogether together(session.interrupt, threads);
  return or_failure(plan_json({.scene = std::move(files),
                               .recipe = recipe,
                               .environment = loaded.environment,
                               .environment_name = loaded.environment_name,
                               .made_of = {},
                               .spill_folder = temporary_folder()},
                              threads));
}

Outcome<std::string> plan_there(const PlanOptions& options, Session& session) {
  KILN_TRY(link, ServerLink::open(session));
  KILN_TRY(input, job_input(options.input, options.recipe, ""));
  return request_plan(link, input);
}

}  // namespace

Outcome<ExitCode> run(const PlanOptions& options, Session& session) {
  KILN_TRY(plan, session.common.server.empty() ? plan_here(options, session) : plan_there(options, session));
  if (plan.empty() || plan.back() != '\n') plan += '\n';
  const Outcome<void> written = write_text("", session.common.json ? plan : plan_text(plan));
  if (!written) return tl::make_unexpected(written.error());
  return ExitCode::ok;
}

}  // namespace kiln
