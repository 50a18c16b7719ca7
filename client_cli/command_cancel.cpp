// kiln cancel ID...: stops jobs; a finished job stays as it is.
#include "client_cli/commands.h"
#include "client_cli/files.h"
#include "client_cli/remote.h"

namespace kiln {

Outcome<ExitCode> run(const CancelOptions& options, Session& session) {
  KILN_TRY(link, ServerLink::open(session));
  for (const std::string& id : options.ids) {
    KILN_TRY(path, job_path(id));
    KILN_TRY(reply, link.post(path + "/cancel", {}, {"application/json", {}}));
    KILN_TRY(job, or_failure(parse_job(reply.body)));
    const Outcome<void> written =
        write_text("", (session.common.json ? job_json(job) : job.id + " " + job.status) + "\n");
    if (!written) return tl::make_unexpected(written.error());
  }
  return ExitCode::ok;
}

}  // namespace kiln
