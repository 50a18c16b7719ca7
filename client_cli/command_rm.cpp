// kiln rm ID...: forgets jobs and their artefacts; a running one is canceled first.
#include <nlohmann/json.hpp>

#include "client_cli/commands.h"
#include "client_cli/files.h"
#include "client_cli/remote.h"

namespace kiln {

Outcome<ExitCode> run(const RemoveOptions& options, Session& session) {
  KILN_TRY(link, ServerLink::open(session));
  for (const std::string& id : options.ids) {
    KILN_TRY(path, job_path(id));
    const auto removed = link.remove(path);
    if (!removed) return tl::make_unexpected(removed.error());
    const std::string line = session.common.json ? nlohmann::json{{"id", id}, {"removed", true}}.dump() : id;
    const Outcome<void> written = write_text("", line + "\n");
    if (!written) return tl::make_unexpected(written.error());
  }
  return ExitCode::ok;
}

}  // namespace kiln
