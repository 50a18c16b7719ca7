// kiln list: the jobs of a server, newest first.
#include "client_cli/commands.h"
#include "client_cli/files.h"
#include "client_cli/job_text.h"
#include "client_cli/remote.h"

namespace kiln {
namespace {

std::string escaped(const std::string& text) {
  static constexpr char kHex[] = "0123456789ABCDEF";
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) || c == '-' || c == '_' || c == '.' || c == '~') {
      out += c;
    } else {
      out += {'%', kHex[byte >> 4], kHex[byte & 15]};
    }
  }
  return out;
}

std::string page_path(const ListOptions& options, const std::string& cursor) {
  std::string path = "/v1/jobs?limit=" + std::to_string(options.limit);
  if (!options.status.empty()) path += "&status=" + escaped(options.status);
  if (!options.label.empty()) path += "&label=" + escaped(options.label);
  if (!cursor.empty()) path += "&cursor=" + escaped(cursor);
  return path;
}

Outcome<JobListReply> fetch_page(ServerLink& link, const ListOptions& options, const std::string& cursor) {
  KILN_TRY(reply, link.get(page_path(options, cursor)));
  return or_failure(parse_job_list(reply.body));
}

}  // namespace

Outcome<ExitCode> run(const ListOptions& options, Session& session) {
  KILN_TRY(link, ServerLink::open(session));
  KILN_TRY(list, fetch_page(link, options, options.cursor));
  while (options.all && !list.next_cursor.empty()) {
    KILN_TRY(page, fetch_page(link, options, list.next_cursor));
    list.jobs.insert(list.jobs.end(), page.jobs.begin(), page.jobs.end());
    list.next_cursor = page.next_cursor;
  }
  const Outcome<void> written = write_text("", session.common.json ? job_list_json(list) + "\n" : jobs_text(list.jobs));
  if (!written) return tl::make_unexpected(written.error());
  if (!list.next_cursor.empty() && !session.common.json) say("more: --all, or --cursor " + list.next_cursor);
  return ExitCode::ok;
}

}  // namespace kiln
