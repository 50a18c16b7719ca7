#include "tests/bench/trade/ratios.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>

#include "tests/bench/bench.h"

namespace kiln::trade {
namespace {

using Figure = std::function<double(const Row&)>;

Ratio ratio_over(const std::vector<const Row*>& rows, const Figure& predicted, const Figure& measured) {
  Ratio out;
  std::vector<double> all;
  double farthest = -1;
  for (const Row* row : rows) {
    const double p = predicted(*row), m = measured(*row);
    if (p <= 0 || m <= 0) continue;
    all.push_back(p / m);
    if (std::abs(std::log(p / m)) <= farthest) continue;
    farthest = std::abs(std::log(p / m));
    out.worst = p / m;
    out.worst_setting = row->setting;
  }
  if (!all.empty()) out.median = bench::median(all);
  return out;
}

Figure of(std::uint64_t Row::*member) {
  return [member](const Row& row) { return static_cast<double>(row.*member); };
}

SceneRatios ratios_of(const std::string& scene, const std::vector<const Row*>& rows) {
  const Figure seconds = [](const Row& r) { return r.predicted_seconds; };
  const Figure all_threads = [](const Row& r) { return r.predicted_seconds * r.threads; };
  return {scene,
          rows.size(),
          ratio_over(rows, seconds, [](const Row& r) { return r.seconds; }),
          ratio_over(rows, all_threads, [](const Row& r) { return r.cpu_seconds; }),
          ratio_over(rows, of(&Row::predicted_rays), of(&Row::rays)),
          ratio_over(rows, of(&Row::predicted_memory_bytes), of(&Row::peak_memory_bytes)),
          ratio_over(rows, of(&Row::predicted_bytes), of(&Row::artifact_bytes)),
          ratio_over(rows, of(&Row::predicted_vertices), of(&Row::vertices))};
}

}  // namespace

std::vector<SceneRatios> prediction_ratios(std::span<const Row> rows) {
  std::vector<std::string> names;
  for (const Row& row : rows) {
    if (std::find(names.begin(), names.end(), row.scene) == names.end()) names.push_back(row.scene);
  }
  std::vector<SceneRatios> out;
  for (const std::string& name : names) {
    std::vector<const Row*> here;
    for (const Row& row : rows) {
      if (row.scene == name) here.push_back(&row);
    }
    out.push_back(ratios_of(name, here));
  }
  return out;
}

std::string ratios_text(const std::vector<SceneRatios>& all) {
  std::string out = "predicted / measured, median and worst of the runs\n";
  char line[256];
  std::snprintf(line, sizeof line, "  %-16s %4s  %-12s  %-12s  %-12s  %-12s  %-12s  %-12s\n", "scene", "runs",
                "seconds", "cpu seconds", "rays", "peak memory", "bytes", "vertices");
  out += line;
  for (const SceneRatios& s : all) {
    std::snprintf(line, sizeof line, "  %-16s %4zu", s.scene.c_str(), s.runs);
    out += line;
    for (const Ratio* r : {&s.seconds, &s.cpu_seconds, &s.rays, &s.memory, &s.bytes, &s.vertices}) {
      std::snprintf(line, sizeof line, "  %5.2f %6.2f", r->median, r->worst);
      out += line;
    }
    out += "\n";
  }
  return out;
}

}  // namespace kiln::trade
