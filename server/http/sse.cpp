#include "server/http/sse.h"

#include <algorithm>

namespace kiln {

std::string sse_text(const SseEvent& event) {
  std::string text;
  if (event.id > 0) text += "id: " + std::to_string(event.id) + "\n";
  text += "event: " + event.name + "\n";
  std::size_t begin = 0;
  while (begin <= event.data.size()) {
    const std::size_t end = std::min(event.data.find_first_of("\r\n", begin), event.data.size());
    text += "data: " + event.data.substr(begin, end - begin) + "\n";
    begin = end + 1;
  }
  return text + "\n";
}

}  // namespace kiln
