// kiln watch ID: follows a job to its end; with --json one line for each event.
#include <nlohmann/json.hpp>

#include "client_cli/commands.h"
#include "client_cli/files.h"
#include "client_cli/remote_bake.h"

namespace kiln {
namespace {

void print_event(const ServerEvent& event) {
  const auto data = nlohmann::json::parse(event.data, nullptr, false);
  if (data.is_discarded()) return;
  const nlohmann::json line = {{"event", event.type}, {"data", data}};
  static_cast<void>(write_text("", line.dump() + "\n"));  // a closed pipe shows at the last line
}

}  // namespace

Outcome<ExitCode> run(const WatchOptions& options, Session& session) {
  KILN_TRY(link, ServerLink::open(session));
  KILN_TRY(job, session.common.json ? watch_job(link, options.id, print_event) : watch_with_bar(link, options.id));
  show_end(job, session);
  const std::string line = session.common.json ? job_json(job) : job.id + " " + job.status;
  const Outcome<void> written = write_text("", line + "\n");
  if (!written) return tl::make_unexpected(written.error());
  return exit_of(job);
}

}  // namespace kiln
