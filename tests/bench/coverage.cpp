// How often does a certificate's interval hold the error? Certifies one delivered file again with many seeds, each with
// points and paths of its own, and takes the mean of their squared errors for the truth: a hundred times the points.
//   kiln_coverage MODEL.glb OUT/scene.glb [--env NAME] [--seeds 100]      OUT is what `kiln bake MODEL.glb` delivered
// Of a light field one JSON line, radiance towards eyes; else two, transport error and error under the job's light:
// truth, share of intervals that hold it, that lie above it and below it, their median width, the spread of the
// estimate (all relative to the truth), median seconds.

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client_cli/files.h"
#include "client_cli/models.h"
#include "client_cli/recipe_input.h"
#include "core/bake/certificate.h"
#include "core/bake/light_field_certificate.h"
#include "tests/bench/bench.h"

namespace kiln {
namespace {

using nlohmann::json;

double truth_of(const std::vector<ErrorStats>& all) {
  double sum = 0;
  for (const ErrorStats& e : all) sum += e.relrmse * e.relrmse;
  return std::sqrt(sum / static_cast<double>(all.size()));
}

void print(const std::string& what, const std::vector<ErrorStats>& all, const std::vector<double>& seconds) {
  if (all.empty()) return;
  const double truth = truth_of(all), count = static_cast<double>(all.size());
  double above = 0, below = 0, variance = 0;
  std::vector<double> widths, points;
  for (const ErrorStats& e : all) {
    above += e.interval_low > truth;
    below += e.interval_high < truth;
    variance += (e.relrmse - truth) * (e.relrmse - truth) / count;
    widths.push_back((e.interval_high - e.interval_low) / truth);
    points.push_back(static_cast<double>(e.points));
  }
  std::printf("%s\n", json{{"error", what},
                           {"truth", truth},
                           {"holds", 1 - (above + below) / count},
                           {"above", above / count},
                           {"below", below / count},
                           {"width", bench::median(widths)},
                           {"spread", std::sqrt(variance) / truth},
                           {"points", bench::median(points)},
                           {"seconds", bench::median(seconds)}}
                          .dump()
                          .c_str());
}

struct Asked {
  std::string model, artefact;
  LightOptions light;
  std::uint64_t seeds = 100;
};

std::optional<Asked> parse(const std::vector<std::string>& words) {
  Asked out;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i] == "--env" && i + 1 < words.size()) {
      out.light.name = words[++i];
    } else if (words[i] == "--seeds" && i + 1 < words.size()) {
      out.seeds = std::stoull(words[++i]);
    } else if (out.model.empty() || out.artefact.empty()) {
      (out.model.empty() ? out.model : out.artefact) = words[i];
    } else {
      return std::nullopt;
    }
  }
  return out.artefact.empty() ? std::nullopt : std::optional(out);
}

Outcome<void> measure(const Asked& asked) {
  Threads threads;
  KILN_TRY(scene, load_scene(asked.model));
  KILN_TRY(baked, load_artefact(asked.artefact));
  KILN_TRY(environment, load_light(asked.light));
  KILN_TRY(report, read_text(std::filesystem::path(asked.artefact).replace_filename("report.json").string()));
  const auto rays = json::parse(report).at("rays").get<std::uint64_t>();
  const Tracer truth(scene, threads);
  std::vector<ErrorStats> radiance, transport, job_light;
  std::vector<double> seconds;
  for (std::uint64_t seed = 1; baked.field.vertices() > 0 && seed <= asked.seeds; ++seed) {
    const FieldCertificate c = certify_field(
        {.decoded = baked, .truth = truth, .environment = environment, .bake_rays = rays, .seed = seed}, threads);
    radiance.push_back(c.radiance);
    seconds.push_back(c.seconds);
  }
  print("radiance", radiance, seconds);
  if (!radiance.empty()) return {};
  for (std::uint64_t seed = 1; seed <= asked.seeds; ++seed) {
    const Certificate c = certify(baked, truth, environment, {.bake_rays = rays, .seed = seed}, threads);
    transport.push_back(c.transport);
    if (c.job_light) job_light.push_back(*c.job_light);
    seconds.push_back(c.seconds);
  }
  print("transport", transport, seconds);
  print("job light", job_light, seconds);
  return {};
}

int run(const std::vector<std::string>& words) {
  const auto asked = parse(words);
  if (!asked) {
    std::fprintf(stderr, "kiln_coverage MODEL.glb OUT/scene.glb [--env NAME] [--seeds 100]\n");
    return 1;
  }
  if (const auto done = measure(*asked); !done) {
    std::fprintf(stderr, "%s\n", done.error().problem.detail.c_str());
    return 1;
  }
  return 0;
}

}  // namespace
}  // namespace kiln

int main(int count, char** words) { return kiln::run({words + 1, words + count}); }
