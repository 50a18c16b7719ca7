#pragma once
// Counters of the front and the Prometheus text of everything there is to see.

#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <utility>

#include "server/http/front.h"
#include "server/work/service.h"

namespace kiln {

class HttpMetrics {
 public:
  void request(const std::string& operation, int status, double seconds);
  struct Served {
    std::uint64_t count = 0;
    double seconds = 0;
  };
  std::map<std::pair<std::string, int>, Served> snapshot() const;

 private:
  mutable std::mutex mutex_;
  std::map<std::pair<std::string, int>, Served> served_;
};

struct MetricsInput {
  std::map<std::pair<std::string, int>, HttpMetrics::Served> served;
  FrontStats front;
  ServiceStats service;
  int uploads = 0, streams = 0, downloads = 0;
  std::int64_t now_ms = 0;
};

/// Text exposition format 0.0.4.
std::string prometheus_text(const MetricsInput&);

}  // namespace kiln
