#pragma once
// Server-sent events, parsed as they arrive (WHATWG HTML, section 9.2.6).

#include <functional>
#include <string>
#include <string_view>

namespace kiln {

struct ServerEvent {
  std::string id, type, data;  // type "message" when the server names none
};

class SseParser {
 public:
  /// Takes any piece of a stream and calls `on_event` for each event that it completes; stops early when that returns
  /// false, and then returns false itself.
  bool feed(std::string_view bytes, const std::function<bool(const ServerEvent&)>& on_event);
  /// The last id seen: what a new connection sends as Last-Event-ID.
  const std::string& last_id() const { return last_id_; }
  /// Forgets half an event: a connection ended.
  void reset();

 private:
  bool take_line(std::string_view line, const std::function<bool(const ServerEvent&)>& on_event);
  std::string line_, last_id_, type_, data_;
  bool has_data_ = false, after_return_ = false;
};

}  // namespace kiln
