// kiln open ID: the address of the viewer; opens it where a person sits at a desktop.
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "client_cli/commands.h"
#include "client_cli/files.h"
#include "client_cli/remote.h"

namespace kiln {
namespace {

bool has_desktop() { return std::getenv("DISPLAY") || std::getenv("WAYLAND_DISPLAY"); }

void open_in_browser(const std::string& url) {
  std::string program = "xdg-open", argument = url;
  char* arguments[] = {program.data(), argument.data(), nullptr};
  pid_t child = 0;
  if (posix_spawnp(&child, program.c_str(), nullptr, nullptr, arguments, environ) == 0) waitpid(child, nullptr, 0);
}

}  // namespace

Outcome<ExitCode> run(const OpenOptions& options, Session& session) {
  KILN_TRY(link, ServerLink::open(session));
  KILN_TRY(job, fetch_job(link, options.id));
  const std::string url = link.url() + "/view/" + job.id;
  const Outcome<void> written =
      write_text("", session.common.json ? nlohmann::json{{"url", url}}.dump() + "\n" : url + "\n");
  if (!written) return tl::make_unexpected(written.error());
  if (isatty(STDOUT_FILENO) == 1 && has_desktop()) open_in_browser(url);
  return ExitCode::ok;
}

}  // namespace kiln
