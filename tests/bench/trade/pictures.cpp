#include "tests/bench/trade/pictures.h"

#include <algorithm>
#include <cstdio>

#include "tests/bench/trade/choose.h"
#include "tests/bench/trade/plot.h"

namespace kiln::trade {
namespace {

std::string number(double x, const char* unit) {
  char out[64];
  std::snprintf(out, sizeof out, "%.3g %s", x, unit);
  return out;
}

std::string seconds_text(double s) { return s < 1 ? number(1000 * s, "ms") : number(s, "s"); }
std::string bytes_text(double b) { return b < 1e6 ? number(b / 1e3, "kB") : number(b / 1e6, "MB"); }
std::string percent_text(double e) { return number(100 * e, "%"); }

std::string tip_of(const Row& row) {
  return row.scene + ": " + row.setting + "\n" + percent_text(row.seen.relrmse) + " [" + percent_text(row.seen.low) +
         ", " + percent_text(row.seen.high) + "], " + seconds_text(row.cpu_seconds) + " of processor, " +
         bytes_text(static_cast<double>(row.artifact_bytes));
}

std::string preset_of(const Row& row, const PresetNames& names) {
  if (row.setting == names.draft) return "draft";
  if (row.setting == names.standard) return "standard";
  return row.setting == names.final ? "final" : "";
}

int standard_order(std::span<const Row> rows, const PresetNames& names) {
  const auto found = std::find_if(rows.begin(), rows.end(), [&](const Row& r) { return r.setting == names.standard; });
  return found == rows.end() ? 0 : order_of(*found);
}

template <class Cost>
Plot plot_of(std::span<const Row> rows, const PresetNames& names, const Cost& cost) {
  Plot plot;
  const int order = standard_order(rows, names);
  for (const Row& row : rows) {
    auto series =
        std::find_if(plot.series.begin(), plot.series.end(), [&](const auto& s) { return s.name == row.scene; });
    if (series == plot.series.end()) series = plot.series.insert(series, {row.scene, {}});
    series->points.push_back({cost(row), row.seen.relrmse, row.seen.low, row.seen.high, order_of(row) >= order,
                              tip_of(row), preset_of(row, names)});
  }
  plot.notes = {"Lines: each scene's Pareto front, with 95 % intervals. Rings: the presets in force.",
                "Hollow: fewer than " + std::to_string(order) + " bands, judged under softer light and in no front."};
  plot.y_label = "transport error, relRMSE where it can be seen";
  plot.y_text = percent_text;
  plot.smallest_y = kSmallestError;
  return plot;
}

}  // namespace

std::string time_svg(std::span<const Row> rows, const PresetNames& names) {
  Plot plot = plot_of(rows, names, [](const Row& row) { return row.cpu_seconds; });
  plot.title = "Time against error";
  plot.x_label = "processor time of the whole bake, all threads";
  plot.x_text = seconds_text;
  return scatter_svg(plot);
}

std::string bytes_svg(std::span<const Row> rows, const PresetNames& names) {
  Plot plot = plot_of(rows, names, [](const Row& row) { return static_cast<double>(row.artifact_bytes); });
  plot.title = "Bytes against error";
  plot.x_label = "size of scene.glb";
  plot.x_text = bytes_text;
  return scatter_svg(plot);
}

}  // namespace kiln::trade
