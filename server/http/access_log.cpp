#include "server/http/access_log.h"

#include <unistd.h>

#include <chrono>
#include <nlohmann/json.hpp>

#include "server/api/job.h"

namespace kiln {
namespace {

std::string capped(const std::string& text) { return text.substr(0, kMaxLogField); }

std::int64_t now_ms() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::milliseconds>(now).count();
}

}  // namespace

std::string access_line(const AccessEntry& entry) {
  using Json = nlohmann::ordered_json;
  Json object = {
      {"time", rfc3339(now_ms())},  {"level", entry.status == 500 || !entry.fault.empty() ? "error" : "info"},
      {"event", "request"},         {"request_id", capped(entry.request_id)},
      {"peer", capped(entry.peer)}, {"method", capped(entry.method)},
      {"path", capped(entry.path)}, {"operation", entry.operation},
      {"status", entry.status},     {"bytes", entry.bytes},
      {"seconds", entry.seconds}};
  if (!entry.fault.empty()) object["fault"] = capped(entry.fault);
  return object.dump(-1, ' ', true, Json::error_handler_t::replace);
}

void log_to_stderr(std::string_view line) {
  const std::string whole = std::string(line) + "\n";
  [[maybe_unused]] const ssize_t ignored = ::write(STDERR_FILENO, whole.data(), whole.size());
}

}  // namespace kiln
