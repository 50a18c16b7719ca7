#pragma once
// What /metrics tells, in the text format of Prometheus: requests are counted here, the rest is asked for.

#include <cstdint>
#include <memory>
#include <string>

#include "server/http/front.h"
#include "server/work/service.h"

namespace kiln {

struct MetricsInput {
  FrontStats front;
  ServiceStats service;
  int uploads = 0, streams = 0, downloads = 0;
  std::int64_t now_ms = 0;
};

/// Any thread may count.
class HttpMetrics {
 public:
  HttpMetrics();
  ~HttpMetrics();
  /// `problem`: the code of what was refused; empty for a success.
  void request(const std::string& operation, int status, double seconds, const std::string& problem);
  /// Text exposition format 0.0.4.
  std::string text(const MetricsInput&) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kiln
