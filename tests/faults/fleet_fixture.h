#pragma once
// Several real kilnds on one PostgreSQL and one place of blobs.

#include <gtest/gtest.h>
#include <stdlib.h>

#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "core/base/sha256.h"
#include "tests/faults/daemon.h"
#include "tests/fixtures/postgres_server.h"

namespace kiln::testing {

using namespace std::chrono_literals;
using nlohmann::json;
using Clock = std::chrono::steady_clock;

inline std::string sha256_of(const std::string& text) {
  return sha256_hex({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

inline double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

inline PostgresServer& postgres() {
  static const std::unique_ptr<PostgresServer> one = std::make_unique<PostgresServer>();
  return *one;
}

class FleetTest : public ::testing::Test {
 protected:
  FleetTest() {
    std::string name = (std::filesystem::temp_directory_path() / "kiln_fleet.XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
    blobs_ = {"--blobs", "dir:" + (folder_ / "shared").string()};
    EXPECT_TRUE(postgres().run("DROP SCHEMA IF EXISTS kiln CASCADE"));
  }
  ~FleetTest() override {
    nodes_.clear();
    std::filesystem::remove_all(folder_);
  }

  /// A server that bakes so many jobs at a time, or none; a lease of 2 s, so that the dead are missed soon.
  Daemon& start(const std::string& name, int workers, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments{"--store",
                                       postgres().url(),
                                       "--workers",
                                       std::to_string(workers),
                                       "--threads",
                                       "1",
                                       "--lease-s",
                                       "2",
                                       "--first-retry-s",
                                       "0.1",
                                       "--soft-free-percent",
                                       "0",
                                       "--hard-free-percent",
                                       "0"};
    arguments.insert(arguments.end(), blobs_.begin(), blobs_.end());
    arguments.insert(arguments.end(), more.begin(), more.end());
    nodes_.erase(name);
    nodes_[name] = std::make_unique<Daemon>(KILN_DAEMON, folder_ / name, arguments);
    return *nodes_[name];
  }

  static std::string upload(const Daemon& node, const std::string& glb = cube_glb()) {
    const std::string scene = sha256_of(glb);
    const int status = http_put(node.port(), "/v1/assets/" + scene, glb).status;
    EXPECT_TRUE(status == 201 || status == 200) << status;
    return scene;
  }
  static std::string submit(const Daemon& node, const std::string& document) {
    const Answer answer = http_post(node.port(), "/v1/jobs", document);
    EXPECT_EQ(answer.status, 202) << answer.body;
    return json::parse(answer.body).at("id");
  }
  static json job(const Daemon& node, const std::string& id, int wait_s = 0) {
    const std::string wait = wait_s > 0 ? "?wait=" + std::to_string(wait_s) : "";
    return json::parse(http_get(node.port(), "/v1/jobs/" + id + wait).body);
  }
  /// A cube that takes some seconds: passes until the error is small.
  static std::string long_job(const std::string& scene, int seed) {
    json document = json::parse(cube_job(scene, seed));
    document.erase("certificate");
    document["quality"] = {{"target_error", 0.004}};
    document["environment"] = {{"builtin", "clear"}};
    document["steps"] = {{{"do", "prt"}, {"order", 6}}};
    return document.dump();
  }
  static void wait_for_worker(const Daemon& node) {
    const auto deadline = Clock::now() + 30s;
    while (node.workers().empty() && Clock::now() < deadline) std::this_thread::sleep_for(5ms);
    ASSERT_FALSE(node.workers().empty()) << "nobody bakes";
  }
  static json wait_end(const Daemon& node, const std::string& id, std::chrono::seconds patience = 90s) {
    json now = job(node, id, 1);
    for (const auto deadline = Clock::now() + patience; Clock::now() < deadline; now = job(node, id, 5)) {
      if (now["status"] != "queued" && now["status"] != "running") break;
    }
    return now;
  }
  static void expect_sound(const Daemon& node, const json& done) {
    EXPECT_EQ(done["status"], "succeeded") << done.dump();
    EXPECT_FALSE(done["artifacts"].empty());
    for (const json& artifact : done["artifacts"]) {
      const Answer file = http_get(node.port(), artifact["url"]);
      EXPECT_EQ(sha256_of(file.body), artifact["sha256"]) << artifact.dump();
    }
  }
  /// How often the story of a job says that it is done.
  static int ends_of(const Daemon& node, const std::string& id) {
    const std::string story = http_get(node.port(), "/v1/jobs/" + id + "/events").body;
    int ends = 0;
    for (auto at = story.find("event: done"); at != std::string::npos; at = story.find("event: done", at + 1)) ++ends;
    return ends;
  }
  static double metric(const Daemon& node, const std::string& name) {
    const std::string text = http_get(node.port(), "/metrics").body;
    const auto at = text.find("\nkiln_" + name + " ");
    return at == std::string::npos ? -1 : std::atof(text.c_str() + at + 7 + name.size());
  }

  std::filesystem::path folder_;
  std::vector<std::string> blobs_;
  std::map<std::string, std::unique_ptr<Daemon>> nodes_;
};

}  // namespace kiln::testing
