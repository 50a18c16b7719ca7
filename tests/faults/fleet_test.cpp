// Several real kilnds on one PostgreSQL and one place of blobs: what one of them takes, another bakes and a third
// shows; whoever is killed or stopped, no acknowledged job is lost and no result is made twice.

#include <signal.h>
#include <sys/wait.h>

#include <cstdlib>
#include <mutex>
#include <random>

#include "tests/faults/fleet_fixture.h"
#include "tests/fixtures/swift_server.h"

namespace kiln::testing {
namespace {

TEST_F(FleetTest, WhatOneServerTakesAnotherBakesAndAThirdShows) {
  const Daemon& a = start("a", 0);
  start("b", 1);
  const Daemon& c = start("c", 0);
  const std::string id = submit(a, cube_job(upload(a), 1));
  std::string story;
  std::thread watcher([&] { story = http_get(c.port(), "/v1/jobs/" + id + "/events").body; });
  const json done = wait_end(c, id);
  watcher.join();
  expect_sound(c, done);
  expect_sound(a, done);
  for (const char* event : {"\"queued\"", "\"running\"", "event: artifact", "event: done"}) {
    EXPECT_NE(story.find(event), std::string::npos) << event << " in " << story;
  }
  EXPECT_EQ(json::parse(http_get(c.port(), "/readyz").body)["checks"]["store"], "ok");
}

TEST_F(FleetTest, TheSameWorksOnAnS3Store) {
  if (!has_swift()) GTEST_SKIP() << "the packages of Swift are not installed";
  const SwiftServer swift;
  ::setenv("AWS_ACCESS_KEY_ID", SwiftServer::kKey, 1);
  ::setenv("AWS_SECRET_ACCESS_KEY", SwiftServer::kSecret, 1);
  blobs_ = {"--blobs", std::string("s3://") + SwiftServer::kBucket, "--s3-endpoint", swift.endpoint()};
  const Daemon& a = start("a", 0);
  start("b", 1);
  const Daemon& c = start("c", 0);
  const std::string id = submit(a, cube_job(upload(a), 1));
  const json done = wait_end(c, id);
  expect_sound(c, done);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "b" / "cas")) << "no blob may stay on a server of its own";
}

TEST_F(FleetTest, AWorkerWithoutADoorBakesForTheOthers) {
  const Daemon& a = start("a", 0);
  Daemon& worker = start("w", 1, {"worker"});
  const std::string id = submit(a, cube_job(upload(a), 1));
  expect_sound(a, wait_end(a, id));
  const int status = worker.terminate();
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
}

TEST_F(FleetTest, TheJobOfAKilledServerRunsAgainElsewhereAfterItsLease) {
  const Daemon& a = start("a", 0);
  Daemon& b = start("b", 1);
  const std::string id = submit(a, long_job(upload(a), 1));
  wait_for_worker(b);
  b.kill_hard();
  const auto killed = Clock::now();
  const Daemon& d = start("d", 1);
  wait_for_worker(d);
  const double again_s = seconds_since(killed);
  EXPECT_LT(again_s, 2 + 10) << "lease + 10 s";
  const json done = wait_end(a, id);
  expect_sound(a, done);
  EXPECT_EQ(done["attempt"], 2);
  EXPECT_EQ(ends_of(a, id), 1);
  std::printf("{\"lease_s\":2,\"runs_again_after_s\":%.2f}\n", again_s);
}

TEST_F(FleetTest, AServerThatSleptThroughItsLeaseCommitsNothing) {
  const Daemon& a = start("a", 0);
  const std::string scene = upload(a);
  int stale = 0;
  for (int round = 0; round < 3; ++round) {
    Daemon& b = start("b", 1);
    const std::string id = submit(a, long_job(scene, round));
    wait_for_worker(b);
    ::kill(b.pid(), SIGSTOP);
    Daemon& d = start("d", 1);
    const json done = wait_end(a, id);
    expect_sound(a, done);
    ::kill(b.pid(), SIGCONT);
    const auto noticed = [&] { return metric(b, "stale_commits_total") + metric(b, "lost_leases_total"); };
    for (int i = 0; i < 200 && noticed() < 1; ++i) std::this_thread::sleep_for(50ms);
    EXPECT_EQ(noticed(), 1);
    stale += static_cast<int>(metric(b, "stale_commits_total"));
    EXPECT_EQ(job(a, id)["artifacts"], done["artifacts"]);
    EXPECT_EQ(ends_of(a, id), 1);
    d.terminate();
  }
  std::printf("{\"rounds\":3,\"stale_commits_refused\":%d}\n", stale);
}

TEST_F(FleetTest, ACancelThroughAnotherServerTakesEffectWithinASecond) {
  const Daemon& a = start("a", 0);
  const Daemon& b = start("b", 1);
  const std::string id = submit(a, long_job(upload(a), 1));
  wait_for_worker(b);
  const auto asked = Clock::now();
  EXPECT_EQ(http_post(a.port(), "/v1/jobs/" + id + "/cancel", "").status, 200);
  const json done = wait_end(a, id);
  const double after_s = seconds_since(asked);
  EXPECT_EQ(done["status"], "canceled");
  EXPECT_LT(after_s, 2) << "1 s, and another for a busy machine";
  std::printf("{\"cancel_s\":%.2f}\n", after_s);
}

TEST_F(FleetTest, ARestartOfTheDatabaseDuringABakeCostsNothing) {
  const Daemon& a = start("a", 1);
  const std::string id = submit(a, long_job(upload(a), 1));
  wait_for_worker(a);
  postgres().stop();
  EXPECT_EQ(http_get(a.port(), "/v1/jobs/" + id).status, 503);
  EXPECT_EQ(http_get(a.port(), "/readyz").status, 503);
  EXPECT_EQ(http_get(a.port(), "/healthz").status, 200);
  postgres().start();
  json done;
  for (const auto deadline = Clock::now() + 60s; Clock::now() < deadline; std::this_thread::sleep_for(100ms)) {
    const Answer answer = http_get(a.port(), "/v1/jobs/" + id);
    if (answer.status == 200 && (done = json::parse(answer.body))["status"] == "succeeded") break;
  }
  expect_sound(a, done);
}

TEST_F(FleetTest, NoAcknowledgedJobIsLostWhicheverServerIsKilled) {
  constexpr int kJobs = 30, kKills = 10;
  std::mutex mutex;  // of the nodes while one of them is replaced
  const std::vector<std::string> names{"a", "b", "c"};
  for (const std::string& name : names) start(name, 1);
  const std::string scene = upload(*nodes_["a"]);
  int kills = 0;
  std::jthread killer([&](const std::stop_token& over) {
    std::mt19937 random(20261126);
    while (!over.stop_requested() && kills < kKills) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100 + random() % 400));
      const std::lock_guard lock(mutex);
      nodes_[names[random() % names.size()]]->kill_hard();
      ++kills;
    }
  });
  std::vector<std::string> ids;
  const auto deadline = Clock::now() + 180s;
  for (int seed = 0; seed < kJobs && Clock::now() < deadline;) {
    std::this_thread::sleep_for(50ms);
    const std::lock_guard lock(mutex);
    const std::string& name = names[static_cast<std::size_t>(seed) % names.size()];
    if (nodes_[name]->pid() <= 0) start(name, 1);
    const Answer answer = http_post(nodes_[name]->port(), "/v1/jobs", cube_job(scene, seed),
                                    {{"Idempotency-Key", "cube-" + std::to_string(seed)}});
    if (answer.status != 200 && answer.status != 202) continue;
    ids.push_back(json::parse(answer.body).at("id"));
    ++seed;
  }
  killer.request_stop();
  killer.join();
  for (const std::string& name : names) {
    if (nodes_[name]->pid() <= 0) start(name, 1);
  }
  ASSERT_EQ(ids.size(), static_cast<std::size_t>(kJobs));
  int attempts = 0;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const Daemon& node = *nodes_[names[i % names.size()]];
    const json done = wait_end(node, ids[i]);
    expect_sound(node, done);
    EXPECT_EQ(ends_of(node, ids[i]), 1);
    attempts += done["attempt"].get<int>();
  }
  EXPECT_GT(kills, 0);
  std::printf("{\"jobs\":%d,\"server_kills\":%d,\"attempts\":%d}\n", kJobs, kills, attempts);
}

}  // namespace
}  // namespace kiln::testing

int main(int argc, char** argv) {
  if (kiln::testing::postgres_programs().empty()) {
    std::puts("skipped: the package postgresql is not installed");
    return 77;
  }
  ::setenv("PGPASSWORD", kiln::testing::PostgresServer::kPassword, 1);
  ::testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
