// kiln pin ID...: keeps jobs or files on the server, or lets them go.
#include <nlohmann/json.hpp>

#include "client_cli/commands.h"
#include "client_cli/files.h"
#include "client_cli/remote.h"

namespace kiln {
namespace {

constexpr std::size_t kHashLetters = 64;  // a job's id has 26

Outcome<std::string> pin_path(const std::string& id) {
  KILN_TRY(job, job_path(id));
  return (id.size() == kHashLetters ? "/v1/assets/" + id : job) + "/pin";
}

}  // namespace

Outcome<ExitCode> run(const PinOptions& options, Session& session) {
  KILN_TRY(link, ServerLink::open(session));
  for (const std::string& id : options.ids) {
    KILN_TRY(path, pin_path(id));
    const auto done = options.off ? link.remove(path) : link.put(path, {}, {});
    if (!done) return tl::make_unexpected(done.error());
    const std::string line = session.common.json ? nlohmann::json{{"id", id}, {"pinned", !options.off}}.dump() : id;
    const Outcome<void> written = write_text("", line + "\n");
    if (!written) return tl::make_unexpected(written.error());
  }
  return ExitCode::ok;
}

}  // namespace kiln
