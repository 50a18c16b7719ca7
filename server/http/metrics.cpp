#include "server/http/metrics.h"

#include <array>
#include <cstdio>
#include <initializer_list>

namespace kiln {
namespace {

std::string number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.9g", value);
  return text.data();
}

struct Sample {
  std::string labels;  // {a="b"} or empty
  double value = 0;
};

void family(std::string& text, const char* name, const char* type, const char* help,
            const std::vector<Sample>& samples) {
  text += "# HELP kiln_" + std::string(name) + " " + help + "\n# TYPE kiln_" + name + " " + type + "\n";
  for (const Sample& sample : samples)
    text += "kiln_" + std::string(name) + sample.labels + " " + number(sample.value) + "\n";
}

double real(std::uint64_t value) { return static_cast<double>(value); }

void service_families(std::string& text, const MetricsInput& in) {
  const ServiceStats& s = in.service;
  family(text, "jobs", "gauge", "Jobs by state.",
         {{"{state=\"queued\"}", real(s.jobs.queued)},
          {"{state=\"running\"}", real(s.jobs.running)},
          {"{state=\"succeeded\"}", real(s.jobs.succeeded)},
          {"{state=\"failed\"}", real(s.jobs.failed)},
          {"{state=\"canceled\"}", real(s.jobs.canceled)}});
  const double oldest =
      s.jobs.oldest_queued_ms > 0 ? static_cast<double>(in.now_ms - s.jobs.oldest_queued_ms) / 1000 : 0;
  family(text, "oldest_queued_seconds", "gauge", "Age of the job that has waited longest.", {{"", oldest}});
  family(text, "jobs_finished_total", "counter", "Jobs that ended since start, by outcome.",
         {{"{outcome=\"succeeded\"}", real(s.succeeded)},
          {"{outcome=\"failed\"}", real(s.failed)},
          {"{outcome=\"canceled\"}", real(s.canceled)},
          {"{outcome=\"cached\"}", real(s.cached)}});
  family(text, "claims_total", "counter", "Attempts started.", {{"", real(s.claimed)}});
  family(text, "claim_latency_seconds_sum", "counter", "From creation to claim, summed over claims.",
         {{"", s.claim_latency_s_sum}});
  family(text, "retries_total", "counter", "Attempts that will be repeated.", {{"", real(s.retried)}});
  family(text, "reaped_total", "counter", "Leases that ended without a word.", {{"", real(s.reaped)}});
  family(text, "lost_leases_total", "counter", "Jobs given up here because their lease was lost or unanswered.",
         {{"", real(s.lost_leases)}});
  family(text, "stale_commits_total", "counter", "Results refused because their claim was lost.",
         {{"", real(s.stale_commits)}});
  family(text, "worker_deaths_total", "counter", "Workers that did not end by themselves, by cause.",
         {{"{cause=\"signal\"}", real(s.deaths_signal)},
          {"{cause=\"memory\"}", real(s.deaths_memory)},
          {"{cause=\"timeout\"}", real(s.deaths_timeout)}});
  family(text, "uploaded_bytes_total", "counter", "Bytes of finished uploads.", {{"", real(s.bytes_uploaded)}});
  family(text, "disk_free_bytes", "gauge", "Free space of the data directory.", {{"", real(s.free_bytes)}});
  family(text, "disk_free_ratio", "gauge", "Free share of the data directory's disk.", {{"", s.free_fraction}});
}

void front_families(std::string& text, const MetricsInput& in) {
  const FrontStats& f = in.front;
  family(text, "http_connections", "gauge", "Open connections.", {{"", real(f.connections)}});
  family(text, "http_serving", "gauge", "Requests with a worker or waiting for one.", {{"", real(f.serving)}});
  family(text, "http_queued", "gauge", "Request heads that wait for a worker.", {{"", real(f.queued)}});
  family(text, "http_accepted_total", "counter", "Connections accepted.", {{"", real(f.accepted)}});
  family(text, "http_refused_total", "counter", "Connections refused before a request was read, by reason.",
         {{"{reason=\"head_timeout\"}", real(f.head_timeouts)},
          {"{reason=\"head_too_large\"}", real(f.head_too_large)},
          {"{reason=\"evicted\"}", real(f.evicted)},
          {"{reason=\"address_cap\"}", real(f.over_address_cap)},
          {"{reason=\"queue_full\"}", real(f.queue_full)}});
  family(text, "http_accept_errors_total", "counter", "accept() failures survived.", {{"", real(f.accept_errors)}});
  family(text, "http_busy", "gauge", "Requests that hold a thread for long, by kind.",
         {{"{kind=\"upload\"}", static_cast<double>(in.uploads)},
          {"{kind=\"stream\"}", static_cast<double>(in.streams)},
          {"{kind=\"download\"}", static_cast<double>(in.downloads)}});
}

void request_families(std::string& text, const MetricsInput& in) {
  std::vector<Sample> counts, seconds;
  for (const auto& [key, served] : in.served) {
    const std::string labels = "{operation=\"" + key.first + "\",status=\"" + std::to_string(key.second) + "\"}";
    counts.push_back({labels, real(served.count)});
    seconds.push_back({labels, served.seconds});
  }
  family(text, "http_requests_total", "counter", "Requests answered.", counts);
  family(text, "http_request_seconds_total", "counter", "Time spent on them.", seconds);
}

}  // namespace

void HttpMetrics::request(const std::string& operation, int status, double seconds) {
  const std::lock_guard lock(mutex_);
  Served& served = served_[{operation, status}];
  ++served.count;
  served.seconds += seconds;
}

std::map<std::pair<std::string, int>, HttpMetrics::Served> HttpMetrics::snapshot() const {
  const std::lock_guard lock(mutex_);
  return served_;
}

std::string prometheus_text(const MetricsInput& in) {
  std::string text;
  service_families(text, in);
  front_families(text, in);
  request_families(text, in);
  return text;
}

}  // namespace kiln
