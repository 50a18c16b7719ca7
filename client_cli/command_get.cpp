// kiln get ID: the job, and its artefacts when a folder is named.
#include "client_cli/commands.h"
#include "client_cli/files.h"
#include "client_cli/job_text.h"
#include "client_cli/remote_bake.h"

namespace kiln {
namespace {

Outcome<ExitCode> show_job(const JobReply& job, const Session& session) {
  const Outcome<void> written = write_text("", session.common.json ? job_json(job) + "\n" : job_text(job));
  if (!written) return tl::make_unexpected(written.error());
  return ExitCode::ok;
}

}  // namespace

Outcome<ExitCode> run(const GetOptions& options, Session& session) {
  KILN_TRY(link, ServerLink::open(session));
  KILN_TRY(job, fetch_job(link, options.id));
  if (options.output.empty() && options.artifact.empty()) return show_job(job, session);
  if (!is_terminal(job)) return fail(ExitCode::error, "not_finished", "job " + job.id + " is still " + job.status);
  show_end(job, session);
  if (job.status != "succeeded") return exit_of(job);
  KILN_TRY(files, download_all(link, job, options.output.empty() ? "." : options.output, options.artifact));
  return show_bake(files, std::nullopt, session);
}

}  // namespace kiln
