#pragma once
// The text of a server-sent event.

#include <cstdint>
#include <string>

namespace kiln {

struct SseEvent {
  std::uint64_t id = 0;  // 0: no id line, so that a reconnecting client does not ask for it
  std::string name;
  std::string data;  // each of its lines becomes a data line
};

std::string sse_text(const SseEvent&);

}  // namespace kiln
