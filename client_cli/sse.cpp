#include "client_cli/sse.h"

namespace kiln {

void SseParser::reset() {
  line_.clear();
  type_.clear();
  data_.clear();
  has_data_ = after_return_ = false;
}

bool SseParser::feed(std::string_view bytes, const std::function<bool(const ServerEvent&)>& on_event) {
  for (const char c : bytes) {
    const bool second_of_pair = after_return_ && c == '\n';
    after_return_ = c == '\r';
    if (second_of_pair) continue;
    if (c != '\n' && c != '\r') {
      line_ += c;
      continue;
    }
    const std::string line = std::move(line_);
    line_.clear();
    if (!take_line(line, on_event)) return false;
  }
  return true;
}

bool SseParser::take_line(std::string_view line, const std::function<bool(const ServerEvent&)>& on_event) {
  if (line.empty()) {
    const ServerEvent event{last_id_, type_.empty() ? "message" : type_, data_};
    const bool complete = has_data_;
    type_.clear();
    data_.clear();
    has_data_ = false;
    return !complete || on_event(event);
  }
  if (line.front() == ':') return true;  // a comment: the heartbeat
  const auto colon = line.find(':');
  const std::string_view field = line.substr(0, colon);
  std::string_view value = colon == std::string_view::npos ? std::string_view{} : line.substr(colon + 1);
  if (!value.empty() && value.front() == ' ') value.remove_prefix(1);
  if (field == "event") type_ = value;
  if (field == "id" && value.find('\0') == std::string_view::npos) last_id_ = value;
  if (field == "data") {
    if (has_data_) data_ += '\n';
    data_ += value;
    has_data_ = true;
  }
  return true;
}

}  // namespace kiln
