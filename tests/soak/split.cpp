// One bake over four workers beside one worker with four threads. Processor time and not wall time: the machine may
// have any number of cores, and other work.

#include <fstream>
#include <sstream>
#include <thread>

#include "tests/soak/soak.h"

namespace kiln::testing {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

constexpr int kThreads = 4;
constexpr double kMostOverhead = 1.10;

struct BakeOnce {
  double processor_s = 0, wall_s = 0;
  int ranges_of_others = 0;
  std::string scene_sha256;  // of the result
};

int ranges_done(int port) {
  const std::string text = http_get(port, "/metrics").body;
  const std::string name = "\nkiln_parts_total ";
  const auto at = text.find(name);
  return at == std::string::npos ? 0 : std::atoi(text.c_str() + at + name.size());
}

double processor_s(Fleet& fleet) {
  double sum = 0;
  for (std::size_t i = 0; i < fleet.size(); ++i) sum += fleet.node(i).processor_s();
  return sum;
}

struct Asked {
  std::string model;
  int samples = 0;
};

std::string read_model(const std::string& model) {
  if (model == "pit") return pit_glb(16);
  std::ifstream file(model, std::ios::binary);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

BakeOnce bake_over(int nodes, const Asked& asked, double share_s, Breaches& breaches) {
  Fleet fleet(true, nodes, {"--workers", "1", "--share-s", std::to_string(share_s)});
  const int port = fleet.node(0).port();
  const std::string scene = sha256_of(asked.model);
  const int stored = http_put(port, "/v1/assets/" + scene, asked.model).status;
  breaches.expect(stored == 201, "the model was answered with " + std::to_string(stored));
  json document = json::parse(cube_job(scene, 1));
  document["environment"] = {{"builtin", "clear"}};
  document["steps"] = {{{"do", "prt"},
                        {"order", 6},
                        {"samples", asked.samples},
                        {"bounces", 1},
                        {"subdivide", "off"},
                        {"merge", "off"}}};
  document["limits"]["threads"] = kThreads / nodes;
  BakeOnce bake;
  const auto begin = Clock::now();
  const double before = processor_s(fleet);
  const Answer answer = http_post(port, "/v1/jobs", document.dump());
  if (answer.status != 202) throw std::runtime_error("the job was answered with " + answer.body);
  const std::string id = json::parse(answer.body).at("id");
  json job = ask_job(port, id);
  while (job["status"] != "succeeded" && job["status"] != "failed") {
    std::this_thread::sleep_for(500ms);
    job = ask_job(port, id);
  }
  bake.wall_s = seconds_since(begin);
  std::this_thread::sleep_for(2s);  // until the last workers are reaped
  bake.processor_s = processor_s(fleet) - before;
  for (std::size_t i = 0; i < fleet.size(); ++i) bake.ranges_of_others += ranges_done(fleet.node(i).port());
  expect_sound(port, job, breaches);
  for (const json& artifact : job["artifacts"])
    if (artifact["name"] == "scene.glb") bake.scene_sha256 = artifact["sha256"];
  return bake;
}

}  // namespace

void run_split(const Split& split, Breaches& breaches) {
  const Asked asked{read_model(split.model), split.samples};
  const BakeOnce whole = bake_over(1, asked, 0, breaches);
  const BakeOnce parts = bake_over(kThreads, asked, split.share_s, breaches);
  const double ratio = parts.processor_s / whole.processor_s;
  breaches.expect(parts.scene_sha256 == whole.scene_sha256, "the bytes of a split bake are others");
  breaches.expect(parts.ranges_of_others > 0, "nothing was given away");
  breaches.expect(ratio < kMostOverhead, "splitting costs a tenth or more");
  std::printf(
      "{\"run\":\"split\",\"workers\":%d,\"share_s\":%g,\"whole_processor_s\":%.1f,\"split_processor_s\":%.1f,"
      "\"processor_ratio\":%.3f,\"wall_ratio\":%.2f,\"ranges_of_others\":%d,\"broken\":%d}\n",
      kThreads, split.share_s, whole.processor_s, parts.processor_s, ratio, parts.wall_s / whole.wall_s,
      parts.ranges_of_others, breaches.count());
}

}  // namespace kiln::testing
