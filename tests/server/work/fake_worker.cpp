// A worker that bakes nothing and fails as its job's label says. Arguments: the folder (last).
//
//   ok        two artefacts         slow     the same after 1 s of progress
//   crash     SIGSEGV               crash-once   SIGSEGV unless the file in `marker` exists, which it makes
//   resume    saves a checkpoint and crashes; with a checkpoint in its order it makes it a result
//   hang      sleeps, ends on TERM  stubborn     sleeps, ignores TERM
//   oom       touches memory until it is stopped   bad-alloc   says out_of_memory
//   garbage   bytes that are no line               silent      exit 0 without a word
//   refuse    a fault of the input, exit 65        full        disk_full
//   share     gives three ranges away, and computes one of them slowly; as a part it makes its range
//   liar      names a result that it did not make  escape      names a result outside its folder

#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace {

using nlohmann::json;

void tell(const std::string& text) {
  if (::write(3, text.data(), text.size()) < 0) std::_Exit(70);
}
void tell(const json& line) { tell(line.dump() + "\n"); }

void artifact(const std::string& name, const std::string& bytes) {
  std::ofstream("out/" + name) << bytes;
  tell({{"artifact", {{"name", name}, {"media_type", "application/octet-stream"}}}});
}

void progress(int done) {
  tell({{"progress", {{"stage", "transfer"}, {"done", done}, {"total", 10}, {"fraction", done / 10.0}}}});
}

int finish(const std::string& scene) {
  artifact("scene.glb", "baked " + scene);
  artifact("report.json", "{}");
  tell(json{{"done", true}});
  return 0;
}

[[noreturn]] void crash() {
  ::signal(SIGSEGV, SIG_DFL);
  ::raise(SIGSEGV);
  std::abort();
}

int fault(const std::string& code, int exit_code) {
  tell({{"fault", {{"code", code}, {"message", "as the test asked"}, {"where", "scene.glb: /meshes/0"}}}});
  return exit_code;
}

[[noreturn]] void sleep_for_ever() {
  while (true) ::pause();
}

int slow(const std::string& scene, int steps) {
  for (int step = 1; step <= steps; ++step) {
    ::usleep(100'000);
    progress(step);
  }
  return finish(scene);
}

int eat_memory() {
  std::vector<std::vector<char>> eaten;
  while (true) {
    eaten.emplace_back(8u << 20, 'x');
    ::usleep(5'000);
  }
}

int crash_once(const std::string& scene) {
  std::ifstream marker_name("inputs/0");  // the scene's bytes name the marker file
  std::string marker;
  std::getline(marker_name, marker);
  if (::access(marker.c_str(), F_OK) == 0) return finish(scene);
  std::ofstream(marker) << "crashed once";
  crash();
}

int resume(const std::string& scene, const std::string& checkpoint) {
  if (checkpoint.empty()) {
    tell({{"checkpoint", "as far as this"}});
    crash();
  }
  artifact("log.txt", checkpoint);
  return finish(scene);
}

/// The answer of the server.
json ask_next() {
  tell(json{{"next", 0}});
  std::string line;
  for (char letter = 0; letter != '\n'; line += letter) {
    if (::read(0, &letter, 1) != 1) std::_Exit(70);
  }
  return json::parse(line);
}

int share(const std::string& scene) {
  std::ofstream("out/journal") << "journal";
  tell({{"share", {{"loop", 0}, {"name", "loop"}, {"journal_bytes", 7}, {"cuts", {0, 1, 2, 3}}}}});
  int taken = 0;
  for (int i = 0; i < 3; ++i) {
    const json reply = ask_next();
    taken += reply["file"] == "" ? 0 : 1;
    if (reply["file"] != "") continue;
    const std::string file = "range." + std::to_string(i);
    ::usleep(2'500'000);
    std::ofstream("out/" + file) << "items";
    tell({{"made", {{"range", reply["range"]}, {"file", file}}}});
  }
  artifact("log.txt", std::to_string(taken));
  return finish(scene);
}

int part() {
  progress(5);
  artifact("range", "items");
  tell(json{{"done", true}});
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (::chdir(argv[argc - 1]) != 0) return 70;
  const json order = json::parse(std::ifstream("job.json"));
  const std::string scene = order["scene"]["sha256"];
  const std::string label = json::parse(order["recipe"].get<std::string>()).value("label", "");
  if (order["mode"] == "plan") {
    std::ofstream("out/plan.json") << R"({"plan":[]})";
    tell(json{{"done", true}});
    return 0;
  }
  if (order["mode"] == "part") return part();
  if (label == "share") return share(scene);
  if (label == "crash") crash();
  if (label == "crash-once") return crash_once(scene);
  if (label == "resume") return resume(scene, order["checkpoint"]);
  if (label == "stubborn") ::signal(SIGTERM, SIG_IGN);
  if (label == "hang" || label == "stubborn") sleep_for_ever();
  if (label == "oom") return eat_memory();
  if (label == "bad-alloc") return fault("out_of_memory", 70);
  if (label == "garbage") tell(std::string("\x01\x02 no line at all\n"));
  if (label == "garbage") sleep_for_ever();
  if (label == "silent") return 0;
  if (label == "refuse") return fault("accessor_out_of_bounds", 65);
  if (label == "full") return fault("disk_full", 70);
  if (label == "liar") tell({{"artifact", {{"name", "scene.glb"}, {"media_type", "model/gltf-binary"}}}});
  if (label == "liar") tell(json{{"done", true}});
  if (label == "liar") return 0;
  if (label == "escape") tell({{"artifact", {{"name", "../../kiln.db"}, {"media_type", "x/y"}}}});
  if (label == "escape") sleep_for_ever();
  if (label == "slow") return slow(scene, 10);
  return finish(scene);
}
