// kiln submit IN: hands a bake to a server and returns at once; the job's id on stdout.
#include "client_cli/commands.h"
#include "client_cli/files.h"
#include "client_cli/remote_bake.h"

namespace kiln {

Outcome<ExitCode> run(const SubmitOptions& options, Session& session) {
  KILN_TRY(link, ServerLink::open(session));
  KILN_TRY(input, job_input(options.input, options.recipe, options.idempotency_key));
  KILN_TRY(job, submit_job(link, input));
  const Outcome<void> written = write_text("", (session.common.json ? job_json(job) : job.id) + "\n");
  if (!written) return tl::make_unexpected(written.error());
  return ExitCode::ok;
}

}  // namespace kiln
