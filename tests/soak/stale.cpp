// A server that sleeps through its lease, again and again.

#include <signal.h>

#include <thread>

#include "tests/soak/soak.h"

namespace kiln::testing {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

double metric(int port, const std::string& name) {
  const std::string text = http_get(port, "/metrics").body;
  const auto at = text.find("\nkiln_" + name + " ");
  return at == std::string::npos ? -1 : std::atof(text.c_str() + at + 7 + name.size());
}

/// Which of two servers bakes; waits for one that does.
std::size_t baker(Fleet& fleet) {
  for (int i = 0; i < 6000; ++i, std::this_thread::sleep_for(5ms)) {
    for (std::size_t node = 0; node < fleet.size(); ++node)
      if (!fleet.node(node).workers().empty()) return node;
  }
  throw std::runtime_error("nobody bakes");
}

/// Long enough to be caught at: passes until the error is small.
std::string long_job(const std::string& scene, int seed) {
  json document = json::parse(cube_job(scene, seed));
  document.erase("certificate");
  document["quality"] = {{"target_error", 0.02}};
  document["environment"] = {{"builtin", "clear"}};
  document["steps"] = {{{"do", "prt"}, {"order", 6}}};
  return document.dump();
}

/// A server that has just slept may have to find its database again first.
std::string submit(int port, const std::string& document, int round) {
  Answer answer;
  for (int i = 0; i < 100; ++i, std::this_thread::sleep_for(100ms)) {
    answer = http_post(port, "/v1/jobs", document, {{"Idempotency-Key", "round-" + std::to_string(round)}});
    if (answer.status == 200 || answer.status == 202) return json::parse(answer.body).at("id");
  }
  throw std::runtime_error("a job was answered with " + std::to_string(answer.status) + " " + answer.body);
}

}  // namespace

void run_stale(const Stale& stale, Breaches& breaches) {
  const auto begin = Clock::now();
  Fleet fleet(true, 2, {"--workers", "1"});
  const std::string scene = upload_cube(fleet.node(0).port());
  int noticed = 0;
  for (int round = 0; round < stale.rounds; ++round) {
    const std::string id = submit(fleet.node(0).port(), long_job(scene, round), round);
    const std::size_t sleeper = baker(fleet);
    const int awake = fleet.node(1 - sleeper).port(), asleep = fleet.node(sleeper).port();
    const double before = metric(asleep, "stale_commits_total") + metric(asleep, "lost_leases_total");
    ::kill(fleet.node(sleeper).pid(), SIGSTOP);
    json job = ask_job(awake, id);
    for (int i = 0; i < 6000 && job["status"] != "succeeded"; ++i, job = ask_job(awake, id))
      std::this_thread::sleep_for(50ms);
    ::kill(fleet.node(sleeper).pid(), SIGCONT);
    const auto lost = [&] {
      return metric(asleep, "stale_commits_total") + metric(asleep, "lost_leases_total") - before;
    };
    for (int i = 0; i < 200 && lost() < 1; ++i) std::this_thread::sleep_for(50ms);
    breaches.expect(lost() == 1, "a server did not notice that its lease was over");
    noticed += static_cast<int>(lost());
    const json after = ask_job(awake, id);
    breaches.expect(after["artifacts"] == job["artifacts"], "a stale commit counted: " + after.dump());
    expect_sound(awake, after, breaches);
  }
  std::printf("{\"run\":\"stale\",\"rounds\":%d,\"noticed\":%d,\"seconds\":%.0f,\"broken\":%d}\n", stale.rounds,
              noticed, seconds_since(begin), breaches.count());
}

}  // namespace kiln::testing
