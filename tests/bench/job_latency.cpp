// How long a trivial job takes through HTTP, from the first byte of its request to its result: prints the median over
// 50 jobs as one JSON line for each recipe. The bar of issue 2 is 300 ms.

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/base/sha256.h"
#include "tests/faults/daemon.h"

namespace kiln::testing {
namespace {

using Clock = std::chrono::steady_clock;
using nlohmann::json;

constexpr int kRuns = 50;

std::string preset_job(const std::string& scene, const std::string& preset, int seed) {
  return json{{"preset", preset}, {"scene", {{"asset", scene}}}, {"seed", seed}}.dump();
}

/// Seconds from submit to succeeded; negative when the job did not succeed.
double run_one(const Daemon& daemon, const std::string& document) {
  const auto start = Clock::now();
  const Answer answer = http_post(daemon.port(), "/v1/jobs", document, {{"Prefer", "wait=20"}});
  const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
  const json job = json::parse(answer.body, nullptr, false);
  return job.is_object() && job.value("status", "") == "succeeded" ? seconds : -1;
}

void report(const std::string& recipe, std::vector<double> seconds) {
  std::ranges::sort(seconds);
  std::printf(
      "{\"bench\":\"job_latency\",\"recipe\":\"%s\",\"triangles\":12,\"runs\":%zu,\"failed\":%td,"
      "\"median_ms\":%.1f,\"p90_ms\":%.1f,\"max_ms\":%.1f}\n",
      recipe.c_str(), seconds.size(), std::ranges::count_if(seconds, [](double s) { return s < 0; }),
      seconds[seconds.size() / 2] * 1e3, seconds[seconds.size() * 9 / 10] * 1e3, seconds.back() * 1e3);
}

int run() {
  std::string name = (std::filesystem::temp_directory_path() / "kiln_latency.XXXXXX").string();
  const std::filesystem::path folder = ::mkdtemp(name.data());
  {
    const Daemon daemon(KILN_DAEMON, folder / "data", {"--soft-free-percent", "0", "--hard-free-percent", "0"});
    const std::string glb = cube_glb();
    const std::string scene = sha256_hex({reinterpret_cast<const std::uint8_t*>(glb.data()), glb.size()});
    http_put(daemon.port(), "/v1/assets/" + scene, glb);
    for (const std::string recipe : {"smallest", "prt-draft", "prt"}) {
      std::vector<double> seconds;
      for (int seed = 0; seed < kRuns; ++seed) {
        seconds.push_back(
            run_one(daemon, recipe == "smallest" ? cube_job(scene, seed) : preset_job(scene, recipe, seed)));
      }
      report(recipe, seconds);
    }
  }
  std::filesystem::remove_all(folder);
  return 0;
}

}  // namespace
}  // namespace kiln::testing

int main() { return kiln::testing::run(); }
