#pragma once
// One JSON object per line and event, whatever strangers put into the values (reliability.md S9).

#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace kiln {

/// Takes one line without its newline.
using LogLine = std::function<void(std::string_view)>;

struct AccessEntry {
  std::string request_id, peer, method, path, operation;  // path without its query: that may hold secrets
  int status = 0;
  std::uint64_t bytes = 0;
  double seconds = 0;
  std::string fault;  // what an exception said; for the operator only, never for the client
};

inline constexpr std::size_t kMaxLogField = 1024;

std::string access_line(const AccessEntry&);

/// Writes a line to stderr in one piece.
void log_to_stderr(std::string_view line);

}  // namespace kiln
