// One bake over many workers: the bytes are those of a single machine, whoever is lost on the way.

#include "tests/faults/fleet_fixture.h"

namespace kiln::testing {
namespace {

/// Bakes of a pit under a sky, of some processor seconds.
json heavy_job(const std::string& scene, const json& step, int seed = 1) {
  json document = json::parse(cube_job(scene, seed));
  document["environment"] = {{"builtin", "clear"}};
  document["steps"] = json::array({step});
  return document;
}

const json kPrt = {{"do", "prt"}, {"order", 6}, {"samples", 4096}, {"bounces", 1}, {"subdivide", "off"}};

std::map<std::string, std::string> hashes_of(const json& job) {
  std::map<std::string, std::string> hashes;
  for (const json& artifact : job.at("artifacts")) {
    const std::string name = artifact.at("name");
    if (name == "scene.glb" || name == "grid.exr") hashes[name] = artifact.at("sha256");
  }
  return hashes;
}

class SharedBakeFleet : public FleetTest {
 protected:
  /// Four servers of one worker with one thread each, that share all that takes longer than .1 s.
  void start_four(const std::string& repeats = "0") {
    for (const char* name : {"w1", "w2", "w3", "w4"}) start(name, 1, {"--share-s", "0.1", "--share-repeats", repeats});
  }
  double sum(const std::string& metric_name) {
    double all = 0;
    for (const auto& [name, node] : nodes_) all += std::max(0.0, metric(*node, metric_name));
    return all;
  }
  double processor() {
    double all = 0;
    for (const auto& [name, node] : nodes_) all += node->processor_s();
    return all;
  }
  static std::string story(const Daemon& node, const std::string& id) {
    return http_get(node.port(), "/v1/jobs/" + id + "/history").body;
  }
};

TEST_F(SharedBakeFleet, ItsBytesAreThoseOfASingleMachine) {
  const std::map<std::string, json> steps{{"prt", kPrt},
                                          {"radiosity", {{"do", "radiosity"}, {"rays", 16384}, {"subdivide", "off"}}},
                                          {"grid", {{"do", "grid"}, {"resolution", {8, 8, 8}}, {"samples", 8192}}}};
  for (const auto& [name, step] : steps) {
    nodes_.clear();
    EXPECT_TRUE(postgres().run("DROP SCHEMA IF EXISTS kiln CASCADE"));
    std::filesystem::remove_all(folder_ / "shared");
    const Daemon& alone = start("alone", 1, {"--share-s", "0"});
    std::string id = submit(alone, heavy_job(upload(alone, pit_glb(16)), step).dump());
    const json plain = wait_end(alone, id);
    expect_sound(alone, plain);
    EXPECT_EQ(story(alone, id).find("given away"), std::string::npos);

    nodes_.clear();
    EXPECT_TRUE(postgres().run("DROP SCHEMA IF EXISTS kiln CASCADE"));
    std::filesystem::remove_all(folder_ / "shared");
    start_four();
    const Daemon& door = *nodes_["w1"];
    id = submit(door, heavy_job(upload(door, pit_glb(16)), step).dump());
    const json shared = wait_end(door, id);
    expect_sound(door, shared);
    EXPECT_EQ(hashes_of(shared), hashes_of(plain)) << name;
    EXPECT_NE(story(door, id).find("ranges are given away"), std::string::npos) << name;
    EXPECT_GE(sum("parts_total"), 1) << name;
    EXPECT_EQ(shared["attempt"], 1);
    EXPECT_EQ(ends_of(door, id), 1);
    std::printf("{\"step\":\"%s\",\"ranges_of_others\":%.0f}\n", name.c_str(), sum("parts_total"));
  }
}

/// Loops are numbered anew in each pass, and journal, ranges and checkpoint go on from pass to pass.
TEST_F(SharedBakeFleet, APromiseOfSeveralPassesHasTheBytesOfASingleMachine) {
  const auto promise = [](const std::string& scene, bool force) {
    json document = heavy_job(scene, {{"do", "prt"}, {"order", 3}});
    document.erase("certificate");
    document["quality"] = {{"target_error", 0.08}};
    document["force"] = force;
    return document.dump();
  };
  const Daemon& alone = start("alone", 1, {"--share-s", "0"});
  const std::string scene = upload(alone, pit_glb(8));
  const json plain = wait_end(alone, submit(alone, promise(scene, false)), 240s);
  expect_sound(alone, plain);
  nodes_.clear();

  for (const char* name : {"w1", "w2", "w3"}) start(name, 1, {"--share-s", "0.05", "--share-repeats", "0"});
  const Daemon& door = *nodes_["w1"];
  const std::string id = submit(door, promise(scene, true));
  const json shared = wait_end(door, id, 240s);
  expect_sound(door, shared);
  EXPECT_EQ(hashes_of(shared), hashes_of(plain));
  EXPECT_EQ(shared["attempt"], 1);
  EXPECT_GE(sum("parts_total"), 1);
  std::size_t passes = 0;
  for (const json& file : shared["artifacts"]) {
    if (file["name"] == "report.json")
      passes = json::parse(http_get(door.port(), file["url"]).body)["promise"]["passes"].size();
  }
  EXPECT_GE(passes, 2U) << "too easy: it shows nothing of a second pass";
  std::printf("{\"passes\":%zu,\"ranges_of_others\":%.0f}\n", passes, sum("parts_total"));
}

TEST_F(SharedBakeFleet, ALostWorkerCostsItsRangeAlone) {
  const Daemon& alone = start("alone", 1, {"--share-s", "0"});
  const std::string scene = upload(alone, pit_glb(16));
  const json plain = wait_end(alone, submit(alone, heavy_job(scene, kPrt).dump()));
  expect_sound(alone, plain);
  nodes_.clear();

  start_four();
  json document = heavy_job(scene, kPrt);
  document["force"] = true;
  const std::string id = submit(*nodes_["w1"], document.dump());
  std::string giver, taker;  // who bakes, and who computes a range
  for (const auto deadline = Clock::now() + 60s; taker.empty() && Clock::now() < deadline;) {
    for (const auto& [name, node] : nodes_) {
      for (const auto& [pid, job] : node->workers()) (job == id ? giver : taker) = name;
    }
  }
  ASSERT_FALSE(giver.empty() || taker.empty());
  nodes_[taker]->kill_hard();
  std::string witness;
  for (const auto& [name, node] : nodes_) {
    if (name != giver && name != taker) witness = name;
  }
  std::this_thread::sleep_for(500ms);
  nodes_[giver]->kill_hard();
  const Daemon& door = *nodes_[witness];
  const json done = wait_end(door, id);
  expect_sound(door, done);
  EXPECT_EQ(hashes_of(done), hashes_of(plain));
  EXPECT_EQ(done["attempt"], 2) << "the bake itself was lost once";
  EXPECT_EQ(ends_of(door, id), 1);
}

TEST_F(SharedBakeFleet, WhenItIsCanceledItsRangesAreToo) {
  start_four();
  const Daemon& door = *nodes_["w1"];
  json step = kPrt;
  step["samples"] = 65536;
  const std::string id = submit(door, heavy_job(upload(door, pit_glb(16)), step).dump());
  const auto workers = [&] {
    std::size_t all = 0;
    for (const auto& [name, node] : nodes_) all += node->workers().size();
    return all;
  };
  for (const auto deadline = Clock::now() + 60s; workers() < 3 && Clock::now() < deadline;)
    std::this_thread::sleep_for(10ms);
  ASSERT_GE(workers(), 3U) << "nobody took a range";
  EXPECT_EQ(http_post(door.port(), "/v1/jobs/" + id + "/cancel", "").status, 200);
  EXPECT_EQ(wait_end(door, id)["status"], "canceled");
  for (const auto deadline = Clock::now() + 10s; workers() > 0 && Clock::now() < deadline;)
    std::this_thread::sleep_for(10ms);
  EXPECT_EQ(workers(), 0U) << "a range of a canceled job goes on";
}

/// Processor time and not wall time: the machine may have any number of cores.
TEST_F(SharedBakeFleet, SplittingCostsLittle) {
  const Daemon& one = start("one", 1, {"--share-s", "0"});
  const std::string scene = upload(one, pit_glb(16));
  json with_four_threads = heavy_job(scene, kPrt);
  with_four_threads["limits"]["threads"] = 4;
  auto start_of = Clock::now();
  double before = processor();
  wait_end(one, submit(one, with_four_threads.dump()));
  const double whole_s = processor() - before, whole_wall = seconds_since(start_of);
  nodes_.clear();

  start_four("8");
  json document = heavy_job(scene, kPrt);
  document["force"] = true;
  before = processor();
  start_of = Clock::now();
  wait_end(*nodes_["w1"], submit(*nodes_["w1"], document.dump()));
  const double split_s = processor() - before, split_wall = seconds_since(start_of);
  std::printf("{\"workers\":4,\"processor_ratio\":%.3f,\"wall_ratio\":%.3f,\"ranges_of_others\":%.0f}\n",
              split_s / whole_s, split_wall / whole_wall, sum("parts_total"));
  EXPECT_LT(split_s / whole_s, 1.35) << "an eighth at most, and what the clock of a busy machine misjudges";
}

}  // namespace
}  // namespace kiln::testing
