// Jobs without a pause: does the server grow?

#include <algorithm>
#include <fstream>
#include <sstream>
#include <thread>

#include "tests/soak/soak.h"

namespace kiln::testing {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

constexpr int kAhead = 4;
constexpr int kSamples = 200;
constexpr int kJudgeFromS = 1800;  // a slope over less says more about the allocator than about us
constexpr double kMostSlope = 1;   // MB/h

struct Sample {
  double hours = 0, rss_mb = 0;
  int descriptors = 0;
};

Sample look_at(pid_t pid, Clock::time_point begin) {
  const std::string process = "/proc/" + std::to_string(pid);
  std::ifstream memory(process + "/smaps_rollup");  // exact: statm lags by up to 64 pages a thread
  double resident_kb = 0;
  for (std::string word; memory >> word && resident_kb == 0;)
    if (word == "Rss:") memory >> resident_kb;
  const auto files = std::filesystem::directory_iterator(process + "/fd");
  return {seconds_since(begin) / 3600, resident_kb * 1024 / 1e6, static_cast<int>(std::distance(files, {}))};
}

/// Least squares over the samples after the first fifth, in which caches fill.
double slope_of(const std::vector<Sample>& samples) {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (std::size_t i = samples.size() / 5; i < samples.size(); ++i) {
    const Sample& s = samples[i];
    n += 1, x += s.hours, y += s.rss_mb, xx += s.hours * s.hours, xy += s.hours * s.rss_mb;
  }
  return (n * xy - x * y) / std::max(n * xx - x * x, 1e-12);
}

/// The most descriptors from one fraction of the samples to another.
int most_descriptors(const std::vector<Sample>& samples, double from, double to) {
  const auto count = static_cast<double>(samples.size());
  int most = 0;
  for (auto i = static_cast<std::size_t>(from * count); i < static_cast<std::size_t>(to * count); ++i)
    most = std::max(most, samples[i].descriptors);
  return most;
}

}  // namespace

void run_steady(const Steady& steady, Breaches& breaches) {
  Fleet fleet(false, 1, {"--workers", "2"});
  const int port = fleet.node(0).port();
  const std::string scene = upload_cube(port);
  std::vector<std::string> ids;
  std::vector<Sample> samples;
  std::size_t first_open = 0;
  const auto begin = Clock::now();
  while (seconds_since(begin) < steady.seconds) {
    while (ids.size() < first_open + kAhead) {
      const Answer answer = http_post(port, "/v1/jobs", cube_job(scene, static_cast<int>(ids.size())));
      breaches.expect(answer.status == 202, "a job was answered with " + std::to_string(answer.status));
      if (answer.status != 202) return;
      ids.push_back(json::parse(answer.body).at("id"));
    }
    const json job = json::parse(http_get(port, "/v1/jobs/" + ids[first_open] + "?wait=5").body);
    if (job["status"] == "queued" || job["status"] == "running") continue;
    expect_sound(port, job, breaches);
    ++first_open;
    if (seconds_since(begin) < steady.seconds * static_cast<double>(samples.size()) / kSamples) continue;
    breaches.expect(http_get(port, "/metrics").status == 200, "no metrics");  // as somebody always scrapes them
    samples.push_back(look_at(fleet.node(0).pid(), begin));
  }
  const int early = most_descriptors(samples, 0.2, 0.6), late = most_descriptors(samples, 0.6, 1);
  const double slope = slope_of(samples);
  breaches.expect(first_open > 0 && samples.size() > 5, "hardly anything ran");
  breaches.expect(late <= early + kAhead, "descriptors grow");  // they come and go with jobs and requests
  if (steady.seconds >= kJudgeFromS) breaches.expect(slope < kMostSlope, "memory grows");
  std::printf(
      "{\"run\":\"steady\",\"seconds\":%d,\"jobs\":%zu,\"rss_mb_first\":%.1f,\"rss_mb_last\":%.1f,"
      "\"rss_mb_per_h\":%.2f,\"descriptors\":[%d,%d],\"broken\":%d}\n",
      steady.seconds, first_open, samples.front().rss_mb, samples.back().rss_mb, slope, early, late, breaches.count());
}

}  // namespace kiln::testing
