#pragma once
// A log-log scatter plot of runs as a self-contained SVG: a colour and a shape for each scene, its front as a line, the
// presets ringed. Light and dark by the reader's system.

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace kiln::trade {

struct PlotPoint {
  double x = 0, y = 0, low = 0, high = 0;  // y's interval
  bool comparable = true;                  // may stand in the front; drawn hollow otherwise
  std::string tip;                         // shown on hover
  std::string preset;                      // "draft" where it is one
};

struct PlotSeries {
  std::string name;
  std::vector<PlotPoint> points;
};

struct Plot {
  std::string title;
  std::vector<std::string> notes;  // lines under the legend
  std::string x_label, y_label;
  std::function<std::string(double)> x_text, y_text;  // of a tick
  double smallest_y = 0;                              // what is below is drawn there, and said to be below
  std::vector<PlotSeries> series;
};

std::string scatter_svg(const Plot&);

/// 1, 2 and 5 times powers of ten within the range; powers alone where that is more than two and a half
/// decades, more between where it is less than eight tenths of one.
std::vector<double> log_ticks(double low, double high);

}  // namespace kiln::trade
