#include "tests/bench/trade/plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tests/bench/trade/front.h"
#include "tests/bench/trade/svg.h"

namespace kiln::trade {
namespace {

constexpr double kWidth = 800, kHeight = 520;
constexpr double kLeft = 76, kRight = 24, kTop = 106, kBottom = 62;
constexpr std::size_t kColours = 6;

// Contrast of every colour to its ground is at least 4.5 : 1.
constexpr const char* kStyle = R"(
svg{--ground:#fffdfb;--text:#241c17;--soft:#65574c;--line:#e2d8cf;--c0:#b5490b;--c1:#1b5a9c;--c2:#1d6b33;--c3:#7a3d9a;--c4:#8a6200;--c5:#a3215c}
@media (prefers-color-scheme:dark){svg{--ground:#1e1a17;--text:#f3ece6;--soft:#b9aca1;--line:#3d352f;--c0:#ff8a45;--c1:#8cc4ff;--c2:#7bd88f;--c3:#d3a4f0;--c4:#f1c76a;--c5:#ff9dc0}}
text{font:13px system-ui,'Segoe UI',Roboto,'DejaVu Sans',sans-serif;fill:var(--text)}
.title{font-size:17px;font-weight:600}.tick,.hint{fill:var(--soft);font-size:12px}
.ground{fill:var(--ground)}.grid{stroke:var(--line);stroke-width:1}
.front{fill:none;stroke-width:2}.reach{stroke-width:1;opacity:.55}
.dot{stroke-width:1.5}.hollow{fill:var(--ground)}.ring{fill:none;stroke:var(--text);stroke-width:1.8}
.name{font-weight:600;paint-order:stroke;stroke:var(--ground);stroke-width:4px;stroke-linejoin:round}
.s0{stroke:var(--c0)}.s1{stroke:var(--c1)}.s2{stroke:var(--c2)}.s3{stroke:var(--c3)}.s4{stroke:var(--c4)}.s5{stroke:var(--c5)}
.f0{fill:var(--c0)}.f1{fill:var(--c1)}.f2{fill:var(--c2)}.f3{fill:var(--c3)}.f4{fill:var(--c4)}.f5{fill:var(--c5)}
)";

/// One axis: logarithms of a range onto pixels.
struct Axis {
  double low = 1, high = 10, from = 0, to = 1;
  double operator()(double value) const {
    return from + (to - from) * (std::log(value) - std::log(low)) / (std::log(high) - std::log(low));
  }
};

/// The range of the values with a margin of a twentieth of it at each end.
Axis axis_around(double low, double high, double from, double to) {
  if (!(low <= high)) low = high = 1;
  const double margin = std::max(1.12, std::pow(high / low, 0.05));
  return {low / margin, high * margin, from, to};
}

struct Frame {
  Axis x, y;
};

double shown_y(const Plot& plot, double y) { return std::max(y, plot.smallest_y); }

Frame frame_of(const Plot& plot) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  double x0 = kNone, x1 = -kNone, y0 = kNone, y1 = -kNone;
  for (const PlotSeries& s : plot.series) {
    for (const PlotPoint& p : s.points) {
      x0 = std::min(x0, p.x), x1 = std::max(x1, p.x);
      y0 = std::min(y0, shown_y(plot, p.y)), y1 = std::max(y1, shown_y(plot, p.y));
    }
  }
  return {axis_around(x0, x1, kLeft, kWidth - kRight), axis_around(y0, y1, kHeight - kBottom, kTop)};
}

std::string text(double x, double y, const std::string& words, const std::string& kind, const char* anchor) {
  return element("text", {{"x", coordinate(x)}, {"y", coordinate(y)}, {"class", kind}, {"text-anchor", anchor}},
                 escape_xml(words));
}

std::string line(double x0, double y0, double x1, double y1, const std::string& kind) {
  return element("line", {{"x1", coordinate(x0)},
                          {"y1", coordinate(y0)},
                          {"x2", coordinate(x1)},
                          {"y2", coordinate(y1)},
                          {"class", kind}});
}

std::string axes(const Plot& plot, const Frame& frame) {
  std::string out;
  const double bottom = kHeight - kBottom, right = kWidth - kRight;
  for (const double tick : log_ticks(frame.x.low, frame.x.high)) {
    out += line(frame.x(tick), kTop, frame.x(tick), bottom, "grid");
    out += text(frame.x(tick), bottom + 18, plot.x_text(tick), "tick", "middle");
  }
  for (const double tick : log_ticks(frame.y.low, frame.y.high)) {
    out += line(kLeft, frame.y(tick), right, frame.y(tick), "grid");
    out += text(kLeft - 8, frame.y(tick) + 4, plot.y_text(tick), "tick", "end");
  }
  out += text((kLeft + right) / 2, kHeight - 16, plot.x_label, "label", "middle");
  const std::string middle = coordinate((kTop + bottom) / 2);
  out += element("text", {{"transform", "translate(20 " + middle + ") rotate(-90)"}, {"text-anchor", "middle"}},
                 escape_xml(plot.y_label));
  return out;
}

/// Circle, square, diamond, two triangles, cross: told apart without colour.
std::string shape(std::size_t kind, double x, double y) {
  constexpr double r = 4.6;
  const auto at = [&](double dx, double dy) { return coordinate(x + dx) + " " + coordinate(y + dy); };
  switch (kind % kColours) {
    case 1:
      return "M" + at(-r * .9, -r * .9) + "L" + at(r * .9, -r * .9) + "L" + at(r * .9, r * .9) + "L" +
             at(-r * .9, r * .9) + "Z";
    case 2:
      return "M" + at(0, -r * 1.3) + "L" + at(r * 1.3, 0) + "L" + at(0, r * 1.3) + "L" + at(-r * 1.3, 0) + "Z";
    case 3:
      return "M" + at(0, -r * 1.2) + "L" + at(r * 1.15, r * .9) + "L" + at(-r * 1.15, r * .9) + "Z";
    case 4:
      return "M" + at(0, r * 1.2) + "L" + at(r * 1.15, -r * .9) + "L" + at(-r * 1.15, -r * .9) + "Z";
    case 5:
      return "M" + at(-r, -r) + "L" + at(r, r) + "M" + at(r, -r) + "L" + at(-r, r);
    default:
      return "M" + at(-r, 0) + "A4.6 4.6 0 1 1 " + at(r, 0) + "A4.6 4.6 0 1 1 " + at(-r, 0) + "Z";
  }
}

std::string numbered(const char* kind, std::size_t series) { return kind + std::to_string(series % kColours); }

std::string dot(const PlotPoint& p, std::size_t series, double x, double y) {
  const std::string fill = p.comparable ? numbered("f", series) : "hollow";
  return element("path", {{"d", shape(series, x, y)}, {"class", "dot " + numbered("s", series) + " " + fill}},
                 element("title", {}, escape_xml(p.tip)));
}

std::string front_line(const PlotSeries& s, std::size_t number, const Plot& plot, const Frame& frame) {
  std::vector<CostError> costs;
  std::vector<const PlotPoint*> points;
  for (const PlotPoint& p : s.points) {
    if (!p.comparable) continue;
    costs.push_back({p.x, p.y});
    points.push_back(&p);
  }
  std::string path, reach;
  for (const std::size_t i : pareto_front(costs)) {
    const PlotPoint& p = *points[i];
    const double x = frame.x(p.x), y = frame.y(shown_y(plot, p.y));
    path += (path.empty() ? "M" : "L") + coordinate(x) + " " + coordinate(y);
    const auto inside = [&](double e) {
      return std::clamp(frame.y(std::max(e, plot.smallest_y)), kTop, kHeight - kBottom);
    };
    reach += line(x, inside(p.low), x, inside(p.high), "reach " + numbered("s", number));
  }
  if (path.empty()) return "";
  return reach + element("path", {{"d", path}, {"class", "front " + numbered("s", number)}});
}

struct Label {
  double x = 0, y = 0;  // of the middle of its box
  bool overlaps(const Label& other) const { return std::abs(x - other.x) < 66 && std::abs(y - other.y) < 15; }
};

/// Beside the ring, where no other label is; nothing when it is crowded all around.
std::string preset_name(const std::string& name, double x, double y, std::vector<Label>& placed) {
  const double half = 3.8 * static_cast<double>(name.size());
  for (const double side : {1.0, -1.0}) {
    for (const double up : {-12.0, 14.0}) {
      const Label label{x + side * (12 + half), y + up};
      const bool outside = label.x + half > kWidth - 4 || label.x - half < kLeft;
      if (outside || std::any_of(placed.begin(), placed.end(), [&](const Label& l) { return l.overlaps(label); }))
        continue;
      placed.push_back(label);
      return text(label.x, label.y + 4, name, "name", "middle");
    }
  }
  return "";
}

std::string preset_marks(const Plot& plot, const Frame& frame) {
  std::string out;
  std::vector<Label> placed;
  for (const PlotSeries& s : plot.series) {
    for (const PlotPoint& p : s.points) {
      if (p.preset.empty()) continue;
      const double x = frame.x(p.x), y = frame.y(shown_y(plot, p.y));
      out += element("circle", {{"cx", coordinate(x)}, {"cy", coordinate(y)}, {"r", "9"}, {"class", "ring"}});
      out += preset_name(p.preset, x, y, placed);
    }
  }
  return out;
}

std::string legend(const Plot& plot) {
  std::string out;
  double x = kLeft;
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    out += element("path", {{"d", shape(i, x + 6, 49)}, {"class", "dot " + numbered("s", i) + " " + numbered("f", i)}});
    out += text(x + 17, 53.5, plot.series[i].name, "label", "start");
    x += 34 + 7.4 * static_cast<double>(plot.series[i].name.size());
  }
  for (std::size_t i = 0; i < plot.notes.size(); ++i)
    out += text(kLeft, 75 + 16 * static_cast<double>(i), plot.notes[i], "hint", "start");
  return out;
}

}  // namespace

std::vector<double> log_ticks(double low, double high) {
  std::vector<double> out;
  const double decades = std::log10(high / low);
  std::vector<double> steps = {1, 2, 5};
  if (decades > 2.5) steps = {1};
  if (decades < 0.8) steps = {1, 1.5, 2, 3, 4, 5, 6, 7, 8, 9};
  for (int e = static_cast<int>(std::floor(std::log10(low))); e <= static_cast<int>(std::ceil(std::log10(high))); ++e) {
    for (const double step : steps) {
      const double tick = e < 0 ? step / std::pow(10.0, -e) : step * std::pow(10.0, e);
      if (tick >= low && tick <= high) out.push_back(tick);
    }
  }
  return out;
}

std::string scatter_svg(const Plot& plot) {
  const Frame frame = frame_of(plot);
  std::string body = element("title", {}, escape_xml(plot.title)) + element("style", {}, kStyle);
  body += element("rect", {{"width", "800"}, {"height", "520"}, {"class", "ground"}});
  body += text(kLeft, 28, plot.title, "title", "start") + legend(plot) + axes(plot, frame);
  for (std::size_t i = 0; i < plot.series.size(); ++i) body += front_line(plot.series[i], i, plot, frame);
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    for (const PlotPoint& p : plot.series[i].points) body += dot(p, i, frame.x(p.x), frame.y(shown_y(plot, p.y)));
  }
  body += preset_marks(plot, frame);
  return element("svg",
                 {{"xmlns", "http://www.w3.org/2000/svg"},
                  {"viewBox", "0 0 800 520"},
                  {"width", "800"},
                  {"height", "520"},
                  {"role", "img"}},
                 body) +
         "\n";
}

}  // namespace kiln::trade
