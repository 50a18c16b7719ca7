// kiln bake IN: from a scene to a folder of artefacts, in this process or on a server.
#include <filesystem>

#include "client_cli/bake_result.h"
#include "client_cli/commands.h"
#include "client_cli/files.h"
#include "client_cli/models.h"
#include "client_cli/progress_bar.h"
#include "client_cli/recipe_input.h"
#include "client_cli/remote_bake.h"
#include "core/bake/bake.h"

namespace kiln {
namespace {

/// The nearest folder that is there already, on the disk that the result goes to.
std::string spill_folder(const std::string& output) {
  namespace fs = std::filesystem;
  std::error_code error;
  fs::path folder = fs::absolute(output, error);
  while (!fs::is_directory(folder, error) && folder.has_relative_path()) folder = folder.parent_path();
  return folder.string();
}

Outcome<BakeInput> bake_input(const std::string& path, const RecipeOptions& options) {
  KILN_TRY(loaded, load_recipe(options, false));
  KILN_TRY(recipe, checked_recipe(loaded));
  KILN_TRY(files, load_files(path));
  BakeInput input;
  input.scene = std::move(files);
  input.recipe = std::move(recipe);
  input.environment = std::move(loaded.environment);
  input.environment_name = loaded.environment_name;
  return input;
}

Outcome<BakeOutput> bake_here(const BakeInput& input, Session& session) {
  Threads threads(input.recipe.limits.threads);
  const StopTogether together(session.interrupt, threads);
  ProgressBar bar(session.terminal);
  return or_failure(bake(
      input, [&](const ProgressEvent& event) { bar.update(event); }, threads));
}

Outcome<BakedFiles> write_artifacts(const BakeOutput& output, const std::string& folder) {
  const Outcome<void> made = make_folder(folder);
  if (!made) return tl::make_unexpected(made.error());
  BakedFiles files{folder, {}, {}};
  for (const ArtifactFile& file : output.files) {
    const Outcome<void> written = write_file((std::filesystem::path(folder) / file.name).string(), file.bytes);
    if (!written) return tl::make_unexpected(written.error());
    files.names.push_back(file.name);
    if (file.name == "report.json") files.report.assign(file.bytes.begin(), file.bytes.end());
  }
  return files;
}

}  // namespace

Outcome<ExitCode> run(const BakeOptions& options, Session& session) {
  if (!session.common.server.empty()) return bake_remotely(options, session);
  const std::string folder = output_folder(options.output, options.input);
  if (const Outcome<void> usable = check_folder(folder); !usable) return tl::make_unexpected(usable.error());
  KILN_TRY(input, bake_input(options.input, options.recipe));
  input.spill_folder = spill_folder(folder);
  KILN_TRY(output, bake_here(input, session));
  KILN_TRY(files, write_artifacts(output, folder));
  return show_bake(files, options.max_error, session);
}

}  // namespace kiln
