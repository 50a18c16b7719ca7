#include "server/http/metrics.h"

#include <prometheus/counter.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>

#include <fstream>
#include <initializer_list>
#include <limits>
#include <sstream>
#include <utility>

namespace kiln {
namespace {

using prometheus::ClientMetric;
using prometheus::MetricFamily;
using prometheus::MetricType;

/// Families that are made anew for each answer, from numbers that live elsewhere.
class Families {
 public:
  struct Sample {
    const char* label;  // the value of the family's label
    double value;
  };

  void gauge(const char* name, const char* help, double value) {
    add(name, help, MetricType::Gauge, "", {{"", value}});
  }
  void counter(const char* name, const char* help, std::uint64_t value) {
    add(name, help, MetricType::Counter, "", {{"", static_cast<double>(value)}});
  }
  void add(const char* name, const char* help, MetricType type, const char* label,
           std::initializer_list<Sample> samples) {
    MetricFamily& family = begin(name, help, type);
    for (const Sample& sample : samples) {
      ClientMetric metric;
      if (*label != '\0') metric.label.push_back({label, sample.label});
      (type == MetricType::Gauge ? metric.gauge.value : metric.counter.value) = sample.value;
      family.metric.push_back(std::move(metric));
    }
  }
  void histogram(const char* name, const char* help, const DurationCounts& times) {
    ClientMetric metric;
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < times.counts.size(); ++i) {
      count += times.counts[i];
      const bool last = i == kDurationBounds.size();
      metric.histogram.bucket.push_back({count, last ? std::numeric_limits<double>::infinity() : kDurationBounds[i]});
    }
    metric.histogram.sample_count = count;
    metric.histogram.sample_sum = times.sum_s;
    begin(name, help, MetricType::Histogram).metric.push_back(std::move(metric));
  }
  std::vector<MetricFamily> all;

 private:
  MetricFamily& begin(const char* name, const char* help, MetricType type) {
    MetricFamily& family = all.emplace_back();
    family.name = std::string("kiln_") + name;
    family.help = help;
    family.type = type;
    return family;
  }
};

double real(std::uint64_t value) { return static_cast<double>(value); }

void add_jobs(Families& to, const MetricsInput& in) {
  const ServiceStats& s = in.service;
  to.add("jobs", "Jobs by state.", MetricType::Gauge, "state",
         {{"queued", real(s.jobs.queued)},
          {"running", real(s.jobs.running)},
          {"succeeded", real(s.jobs.succeeded)},
          {"failed", real(s.jobs.failed)},
          {"canceled", real(s.jobs.canceled)}});
  const std::int64_t oldest = s.jobs.oldest_queued_ms;
  to.gauge("oldest_queued_seconds", "Age of the job that has waited longest.",
           oldest > 0 ? static_cast<double>(in.now_ms - oldest) / 1000 : 0);
  to.add("jobs_finished_total", "Jobs that ended since start, by outcome.", MetricType::Counter, "outcome",
         {{"succeeded", real(s.succeeded)},
          {"failed", real(s.failed)},
          {"canceled", real(s.canceled)},
          {"cached", real(s.cached)}});
  to.counter("attempts_total", "Attempts started.", s.claimed);
  to.histogram("claim_latency_seconds", "From creation to claim.", s.claim_latency);
  to.counter("parts_total", "Ranges of bakes computed for whoever gave them away.", s.parts);
  to.counter("retries_total", "Attempts that will be repeated.", s.retried);
  to.counter("reaped_total", "Leases that ended without a word.", s.reaped);
  to.counter("forgotten_total", "Jobs whose time was over by the retention in force.", s.forgotten);
  to.counter("lost_leases_total", "Jobs given up here because their lease was lost or unanswered.", s.lost_leases);
  to.counter("stale_commits_total", "Results refused because their claim was lost.", s.stale_commits);
}

void add_webhooks(Families& to, const ServiceStats& s) {
  to.gauge("webhook_pending", "Messages that wait for their receivers, of the whole store.", real(s.jobs.deliveries));
  to.add("webhook_messages_total", "Messages that this server has done with since start, by outcome.",
         MetricType::Counter, "outcome",
         {{"delivered", real(s.webhooks.delivered)}, {"failed", real(s.webhooks.failed)}});
  to.counter("webhook_retries_total", "Tries to deliver that failed and come again.", s.webhooks.retried);
}

void add_machine(Families& to, const ServiceStats& s) {
  to.add("worker_deaths_total", "Workers that did not end by themselves, by cause.", MetricType::Counter, "cause",
         {{"signal", real(s.deaths_signal)}, {"memory", real(s.deaths_memory)}, {"timeout", real(s.deaths_timeout)}});
  to.add("sandbox", "1 where this kernel locks workers in: files (Landlock), calls (seccomp).", MetricType::Gauge,
         "lock", {{"files", s.sandbox.files ? 1.0 : 0.0}, {"calls", s.sandbox.calls ? 1.0 : 0.0}});
  to.counter("uploaded_bytes_total", "Bytes of finished uploads.", s.bytes_uploaded);
  to.gauge("disk_free_bytes", "Free space of the data directory.", real(s.free_bytes));
  to.gauge("disk_free_ratio", "Free share of the data directory's disk.", s.free_fraction);
  to.histogram("fsync_seconds", "Syncs of blobs and their folders.", s.syncs);
}

/// Connections that the kernel dropped because nobody accepted them in time; of this network namespace.
std::uint64_t listen_drops() {
  std::ifstream file("/proc/net/netstat");
  for (std::string names, values; std::getline(file, names) && std::getline(file, values);) {
    std::istringstream name_words(names), value_words(values);
    std::string name, value;
    while (name_words >> name && value_words >> value)
      if (name == "ListenDrops") return std::strtoull(value.c_str(), nullptr, 10);
  }
  return 0;
}

void add_front(Families& to, const MetricsInput& in) {
  const FrontStats& f = in.front;
  to.gauge("http_connections", "Open connections.", real(f.connections));
  to.gauge("http_serving", "Requests with a worker or waiting for one.", real(f.serving));
  to.gauge("http_queued", "Request heads that wait for a worker.", real(f.queued));
  to.counter("http_accepted_total", "Connections accepted.", f.accepted);
  to.add("http_refused_total", "Connections refused before a request was read, by reason.", MetricType::Counter,
         "reason",
         {{"head_timeout", real(f.head_timeouts)},
          {"head_too_large", real(f.head_too_large)},
          {"evicted", real(f.evicted)},
          {"address_cap", real(f.over_address_cap)},
          {"queue_full", real(f.queue_full)}});
  to.counter("http_accept_errors_total", "accept() failures survived.", f.accept_errors);
  to.counter("listen_drops_total", "Connections that the kernel dropped from full backlogs, of all programs here.",
             listen_drops());
  to.add("http_busy", "Requests that hold a thread for long, by kind.", MetricType::Gauge, "kind",
         {{"upload", static_cast<double>(in.uploads)},
          {"stream", static_cast<double>(in.streams)},
          {"download", static_cast<double>(in.downloads)}});
}

}  // namespace

struct HttpMetrics::State {
  prometheus::Registry registry;
  prometheus::Family<prometheus::Counter>& requests =
      prometheus::BuildCounter().Name("kiln_http_requests_total").Help("Requests answered.").Register(registry);
  prometheus::Family<prometheus::Counter>& problems =
      prometheus::BuildCounter().Name("kiln_http_problems_total").Help("Requests refused, by code.").Register(registry);
  prometheus::Family<prometheus::Histogram>& seconds =
      prometheus::BuildHistogram().Name("kiln_http_request_seconds").Help("Time spent on them.").Register(registry);
};

HttpMetrics::HttpMetrics() : state_(std::make_unique<State>()) {}
HttpMetrics::~HttpMetrics() = default;

void HttpMetrics::request(const std::string& operation, int status, double seconds, const std::string& problem) {
  static const prometheus::Histogram::BucketBoundaries kBounds(kDurationBounds.begin(), kDurationBounds.end());
  state_->requests.Add({{"operation", operation}, {"status", std::to_string(status)}}).Increment();
  state_->seconds.Add({{"operation", operation}}, kBounds).Observe(seconds);
  if (!problem.empty()) state_->problems.Add({{"code", problem}}).Increment();
}

std::string HttpMetrics::text(const MetricsInput& in) const {
  Families families;
  add_jobs(families, in);
  add_webhooks(families, in.service);
  add_machine(families, in.service);
  add_front(families, in);
  for (MetricFamily& family : state_->registry.Collect()) families.all.push_back(std::move(family));
  return prometheus::TextSerializer().Serialize(families.all);
}

}  // namespace kiln
