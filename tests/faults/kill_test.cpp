// kill -9 of workers and of the server at random moments of 50 bakes: no acknowledged job is lost, every artefact has
// the hash it is named by, nothing runs for ever, nothing temporary stays.

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <sstream>
#include <thread>

#include "core/base/sha256.h"
#include "tests/faults/daemon.h"

namespace kiln::testing {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using Clock = std::chrono::steady_clock;

constexpr int kJobs = 50;
constexpr int kServerKills = 8;
constexpr int kWorkerKills = 12;
constexpr unsigned kSeed = 20261122;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

std::string sha256_of(const std::string& text) {
  return sha256_hex({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

class KillTest : public ::testing::Test {
 protected:
  KillTest() {
    std::string name = (std::filesystem::temp_directory_path() / "kiln_faults.XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
    start();
    scene_ = sha256_of(cube_glb());
    EXPECT_EQ(http_put(daemon_->port(), "/v1/assets/" + scene_, cube_glb()).status, 201);
  }
  ~KillTest() override {
    daemon_.reset();
    std::filesystem::remove_all(folder_);
  }

  void start() {
    const std::lock_guard lock(mutex_);
    daemon_.reset();
    daemon_ =
        std::make_unique<Daemon>(KILN_DAEMON, folder_ / "data",
                                 std::vector<std::string>{"--workers", "2", "--threads", "1", "--first-retry-s", "0.1",
                                                          "--soft-free-percent", "0", "--hard-free-percent", "0"});
  }

  /// From any thread, at any moment: whoever speaks to the server finds it gone and starts it again.
  void kill_server() {
    const std::lock_guard lock(mutex_);
    ::kill(daemon_->pid(), SIGKILL);
    ++server_kills_;
  }

  /// Submits until the server answers; the idempotency key makes a second try the same job.
  std::string submit(int seed) {
    for (int attempt = 0; attempt < 100; ++attempt) {
      const Answer answer = http_post(daemon_->port(), "/v1/jobs", cube_job(scene_, seed),
                                      {{"Idempotency-Key", "cube-" + std::to_string(seed)}});
      if (answer.status == 200 || answer.status == 202) return json::parse(answer.body).at("id");
      EXPECT_EQ(answer.status, 0) << answer.body;
      start();
    }
    return {};
  }

  json job(const std::string& id) {
    const Answer answer = http_get(daemon_->port(), "/v1/jobs/" + id);
    EXPECT_EQ(answer.status, 200) << "acknowledged job " << id << " is lost";
    return answer.status == 200 ? json::parse(answer.body) : json{{"status", "lost"}, {"artifacts", json::array()}};
  }

  /// The job once it has ended, or as it is after 240 s: against hanging for ever; jobs here take seconds.
  json finished(const std::string& id) {
    const auto deadline = Clock::now() + 240s;
    json now = job(id);
    while ((now["status"] == "queued" || now["status"] == "running") && Clock::now() < deadline)
      now = json::parse(http_get(daemon_->port(), "/v1/jobs/" + id + "?wait=5").body);
    return now;
  }

  /// Kills one worker whose job was not hit before: a second crash would rightly fail it.
  bool kill_a_worker() {
    const std::lock_guard lock(mutex_);
    for (const auto& [pid, id] : daemon_->workers()) {
      if (!hit_.insert(id).second) continue;
      ::kill(pid, SIGKILL);
      return true;
    }
    return false;
  }

  void expect_sound(const json& job) {
    EXPECT_EQ(job["status"], "succeeded") << job.dump();
    EXPECT_FALSE(job["artifacts"].empty());
    for (const json& artifact : job["artifacts"]) {
      const Answer file = http_get(daemon_->port(), artifact["url"]);
      EXPECT_EQ(sha256_of(file.body), artifact["sha256"]) << artifact.dump();
      EXPECT_EQ(file.body.size(), artifact["bytes"]);
    }
  }

  static int entries(const std::filesystem::path& folder) {
    return static_cast<int>(std::distance(std::filesystem::directory_iterator(folder), {}));
  }

  std::filesystem::path folder_;
  std::unique_ptr<Daemon> daemon_;
  std::string scene_;
  std::set<std::string> hit_;
  std::mutex mutex_;  // of daemon_ while another thread may kill it
  int server_kills_ = 0;
};

TEST_F(KillTest, NoAcknowledgedJobIsLostWhoeverIsKilled) {
  const auto deadline = Clock::now() + 240s;  // against hanging for ever; some 20 s on two idle cores
  int worker_kills = 0;
  std::jthread killer([&](const std::stop_token& over) {
    std::mt19937 random(kSeed);
    std::uniform_int_distribution<int> pause_ms(5, 250);
    while (!over.stop_requested() && (server_kills_ < kServerKills || worker_kills < kWorkerKills)) {
      std::this_thread::sleep_for(std::chrono::milliseconds(pause_ms(random)));
      if (worker_kills < kWorkerKills && kill_a_worker()) ++worker_kills;
      if (server_kills_ < kServerKills && random() % 3 == 0) kill_server();
    }
  });
  std::vector<std::string> acknowledged;
  for (int seed = 0; seed < kJobs; ++seed) {
    ASSERT_LT(Clock::now(), deadline) << "too slow: " << seed << " jobs";
    acknowledged.push_back(submit(seed));
    // Not too far ahead of the workers, so that the kills fall among all of the jobs.
    if (seed >= 8) http_get(daemon_->port(), "/v1/jobs/" + acknowledged[acknowledged.size() - 8] + "?wait=1");
  }
  killer.request_stop();
  killer.join();
  if (http_get(daemon_->port(), "/healthz").status == 0) start();
  EXPECT_GT(server_kills_, 0);
  EXPECT_GT(worker_kills, 0);

  for (const std::string& id : acknowledged) expect_sound(finished(id));
  EXPECT_EQ(std::set(acknowledged.begin(), acknowledged.end()).size(), acknowledged.size());
  EXPECT_TRUE(daemon_->workers().empty());

  const int status = daemon_->terminate();
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
  EXPECT_EQ(entries(folder_ / "data" / "work"), 0);
  EXPECT_EQ(entries(folder_ / "data" / "tmp"), 0);
  for (const auto& file : std::filesystem::recursive_directory_iterator(folder_ / "data" / "cas")) {
    if (!file.is_regular_file()) continue;
    std::ifstream in(file.path(), std::ios::binary);
    std::stringstream text;
    text << in.rdbuf();
    EXPECT_EQ(sha256_of(text.str()), file.path().filename());
  }
  std::printf("{\"jobs\":%d,\"server_kills\":%d,\"worker_kills\":%d}\n", kJobs, server_kills_, worker_kills);
}

TEST_F(KillTest, TermPutsRunningJobsBackAndTheNextStartFinishesThem) {
  std::vector<std::string> ids;
  for (int seed = 100; seed < 106; ++seed) ids.push_back(submit(seed));
  const auto asked = Clock::now();
  const int status = daemon_->terminate();
  const double to_exit = seconds_since(asked);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
  EXPECT_LT(to_exit, 30);  // the promise, not a rate
  EXPECT_EQ(entries(folder_ / "data" / "work"), 0);
  std::printf("{\"term_to_exit_s\":%.2f}\n", to_exit);
  start();
  for (const std::string& id : ids) {
    const json done = finished(id);
    expect_sound(done);
    EXPECT_LE(done["attempt"], 1) << "a drain must not cost an attempt";
  }
}

TEST_F(KillTest, AWorkerKilledBetweenPassesGoesOnWhereItWasAndEndsWithTheSameBytes) {
  // Four passes and more: a tenth of a second for the first, seconds for the last. Twice, with force, so that the
  // second is the undisturbed run of the same job.
  json document = json::parse(cube_job(scene_, 1));
  document.erase("certificate");
  document["quality"] = {{"target_error", 0.004}};
  document["environment"] = {{"builtin", "clear"}};
  document["steps"] = {{{"do", "prt"}, {"order", 6}}};
  const auto submit_one = [&](bool force) {
    document["force"] = force;
    return json::parse(http_post(daemon_->port(), "/v1/jobs", document.dump(), {}).body).at("id").get<std::string>();
  };
  const auto sha_of_scene = [](const json& done) {
    for (const json& artifact : done["artifacts"])
      if (artifact["name"] == "scene.glb") return artifact["sha256"].get<std::string>();
    return std::string("no scene.glb");
  };
  const std::string id = submit_one(false);
  const auto deadline = Clock::now() + 60s;
  while (!std::filesystem::exists(folder_ / "data" / "checkpoints" / id) && Clock::now() < deadline)
    std::this_thread::sleep_for(2ms);
  ASSERT_TRUE(kill_a_worker()) << "the bake ended before it could be killed";
  const auto killed = Clock::now();
  while (json::parse(http_get(daemon_->port(), "/v1/jobs/" + id).body)["attempt"] == 1 && Clock::now() < deadline)
    std::this_thread::sleep_for(2ms);
  std::printf("{\"runs_again_after_s\":%.2f}\n", seconds_since(killed));
  const json cut = finished(id);
  expect_sound(cut);
  EXPECT_EQ(cut["attempt"], 2);
  const json whole = finished(submit_one(true));
  EXPECT_EQ(whole["attempt"], 1);
  EXPECT_EQ(sha_of_scene(cut), sha_of_scene(whole));
  EXPECT_EQ(entries(folder_ / "data" / "checkpoints"), 0);
}

}  // namespace
}  // namespace kiln::testing
