// kill -9 at random moments. A thread submits and never lets the queue run dry; the killer goes through its cycles.

#include <signal.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <random>
#include <set>
#include <sstream>
#include <thread>

#include "tests/soak/soak.h"

namespace kiln::testing {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

constexpr unsigned kSeed = 20261127;
constexpr int kAhead = 6;  // unfinished jobs, so that there is always something to hit
constexpr double kStuckS = Fleet::kLeaseS + 10;

class KillRun {
 public:
  KillRun(const Kills& kills, Breaches& breaches)
      : kills_(kills),
        breaches_(breaches),
        fleet_(kills.postgres, kills.postgres ? 2 : 1, {"--workers", "2"}),
        scene_(upload_cube(fleet_.node(0).port())) {}

  void run() {
    const auto begin = Clock::now();
    std::thread submitter([this] { submit_until_over(); });
    for (int cycle = 0; cycle < kills_.cycles; ++cycle) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50 + random_() % 350));
      const std::lock_guard lock(mutex_);
      kill_something(cycle);
      fleet_.start();
    }
    over_ = true;
    submitter.join();
    look();
    std::printf(
        "{\"run\":\"kills\",\"engine\":\"%s\",\"cycles\":%d,\"server_kills\":%d,\"worker_kills\":%d,\"jobs\":%zu,"
        "\"attempts\":%d,\"longest_run_s\":%.1f,\"seconds\":%.0f,\"broken\":%d}\n",
        kills_.postgres ? "postgres" : "sqlite", kills_.cycles, server_kills_, worker_kills_, ids_.size(), attempts_,
        longest_run_s_, seconds_since(begin), breaches_.count());
  }

 private:
  /// In turn a server, a worker, and a worker with its server. No job twice by its worker: that would rightly fail it.
  void kill_something(int cycle) {
    Daemon& victim = fleet_.node(random_() % fleet_.size());
    if (cycle % 3 != 0) {
      for (int wait = 0; wait < 200 && !kill_a_worker(victim); ++wait) std::this_thread::sleep_for(5ms);
    }
    if (cycle % 3 == 1) return;
    victim.kill_hard();
    ++server_kills_;
  }

  bool kill_a_worker(const Daemon& victim) {
    for (const auto& [pid, id] : victim.workers()) {
      if (!hit_.insert(id).second) continue;
      ::kill(pid, SIGKILL);
      ++worker_kills_;
      return true;
    }
    return false;
  }

  void submit_until_over() {
    for (int seed = 0; !over_; std::this_thread::sleep_for(10ms)) {
      const std::lock_guard lock(mutex_);
      const int port = fleet_.node(static_cast<std::size_t>(seed) % fleet_.size()).port();
      watch(port);
      if (unfinished_ >= kAhead) continue;
      const Answer answer =
          http_post(port, "/v1/jobs", cube_job(scene_, seed), {{"Idempotency-Key", "cube-" + std::to_string(seed)}});
      if (answer.status != 200 && answer.status != 202) continue;  // not acknowledged: the same again
      ids_.push_back(json::parse(answer.body).at("id"));
      ++seed;
    }
  }

  /// How many wait or run, and how long the oldest has been running since somebody last took it.
  void watch(int port) {
    unfinished_ = 0;
    for (const char* status : {"queued", "running"}) {
      const Answer answer = http_get(port, std::string("/v1/jobs?limit=200&status=") + status);
      if (answer.status != 200) return;
      const json jobs = json::parse(answer.body).at("jobs");
      unfinished_ += static_cast<int>(jobs.size());
      if (std::string_view(status) == "queued") continue;
      std::set<std::string> now;
      for (const json& job : jobs) {
        const std::string run = job["id"].get<std::string>() + "/" + job["attempt"].dump();
        now.insert(run);
        since_.emplace(run, Clock::now());
        longest_run_s_ = std::max(longest_run_s_, seconds_since(since_[run]));
      }
      std::erase_if(since_, [&](const auto& entry) { return !now.contains(entry.first); });
    }
  }

  void look() {
    const int port = fleet_.node(0).port();
    const auto deadline = Clock::now() + 120s;
    for (const std::string& id : ids_) {
      json job = ask_job(port, id);
      while ((job["status"] == "queued" || job["status"] == "running") && Clock::now() < deadline) {
        std::this_thread::sleep_for(50ms);
        watch(port);
        job = ask_job(port, id);
      }
      expect_sound(port, job, breaches_);
      attempts_ += job.value("attempt", 0);
    }
    breaches_.expect(std::set(ids_.begin(), ids_.end()).size() == ids_.size(), "two submissions got one job");
    breaches_.expect(longest_run_s_ < kStuckS, "a job was running for longer than its lease and 10 s");
    breaches_.expect(server_kills_ > 0 && worker_kills_ > 0, "nothing was killed");
    for (std::size_t i = 0; i < fleet_.size(); ++i) {
      breaches_.expect(fleet_.node(i).terminate() == 0, "a server did not end well");
      breaches_.expect(std::filesystem::is_empty(fleet_.data(i) / "work"), "a work folder was left");
    }
    for (const auto& file : std::filesystem::recursive_directory_iterator(fleet_.blobs() / "cas")) {
      if (!file.is_regular_file()) continue;
      std::ifstream in(file.path(), std::ios::binary);
      std::stringstream text;
      text << in.rdbuf();
      breaches_.expect(sha256_of(text.str()) == file.path().filename(), "a blob with another hash than its name");
    }
  }

  const Kills kills_;
  Breaches& breaches_;
  Fleet fleet_;
  const std::string scene_;
  std::mt19937 random_{kSeed};
  std::mutex mutex_;  // of the fleet while a part of it is replaced
  std::atomic<bool> over_{false};
  std::vector<std::string> ids_;  // acknowledged
  std::set<std::string> hit_;
  std::map<std::string, Clock::time_point> since_;
  double longest_run_s_ = 0;
  int unfinished_ = 0, server_kills_ = 0, worker_kills_ = 0, attempts_ = 0;
};

}  // namespace

void run_kills(const Kills& kills, Breaches& breaches) { KillRun(kills, breaches).run(); }

}  // namespace kiln::testing
