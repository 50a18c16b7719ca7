#include "core/reduce/charts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <queue>
#include <span>
#include <unordered_map>

namespace kiln {
namespace {

using Point = Vec2<double>;
using Flat = std::array<Point, 3>;

double turn(const Point& a, const Point& b, const Point& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// Whether the insides of two triangles with positive turn have a common point: no edge of either has all of the other
/// on its outer side. `slack` is a doubled area that rounding may make of nothing.
bool overlap(const Flat& a, const Flat& b, double slack) {
  const auto parted = [&](const Flat& p, const Flat& q) {
    for (std::size_t i = 0; i < 3; ++i) {
      const Point &from = p[i], &to = p[(i + 1) % 3];
      if (turn(from, to, q[0]) <= slack && turn(from, to, q[1]) <= slack && turn(from, to, q[2]) <= slack) return true;
    }
    return false;
  };
  return !parted(a, b) && !parted(b, a);
}

class Splitter {
 public:
  Splitter(const std::vector<Vec3d>& position, const std::vector<Triangle>& triangles)
      : position_(position), triangles_(triangles) {
    for (const Triangle& t : triangles) {
      const Vec3d &a = position[t[0]], &b = position[t[1]], &c = position[t[2]];
      area_.push_back(cross(b - a, c - a) * 0.5);
      center_.push_back((a + b + c) / 3.0);
    }
  }

  /// Leaves in the order of the tree, those that lie flat together joined.
  std::vector<Chart> run() { return join(leaves()); }

 private:
  std::vector<Chart> leaves() const {
    std::vector<std::uint32_t> all(triangles_.size());
    std::iota(all.begin(), all.end(), 0U);
    std::vector<Chart> charts;
    std::vector<std::span<std::uint32_t>> stack{all};
    while (!stack.empty()) {
      const std::span<std::uint32_t> some = stack.back();
      stack.pop_back();
      if (some.empty()) continue;
      Chart chart;
      if (some.size() == 1 || lies_flat(some, chart)) {
        if (some.size() == 1) set_frame(some, chart);
        chart.triangles.assign(some.begin(), some.end());
        std::sort(chart.triangles.begin(), chart.triangles.end());
        shrink(chart);
        charts.push_back(std::move(chart));
        continue;
      }
      const std::size_t half = part(some, chart);
      stack.push_back(some.subspan(half));
      stack.push_back(some.first(half));
    }
    return charts;
  }

  struct Seam {
    double length;
    std::uint32_t a, b;                    // charts, a < b
    bool operator<(const Seam& o) const {  // the longest first
      if (length != o.length) return length < o.length;
      return a != o.a ? a > o.a : b > o.b;
    }
  };
  using Seams = std::unordered_map<std::uint32_t, double>;  // length by neighbour

  /// Neighbours along each chart's border.
  std::vector<Seams> seams_of(const std::vector<Chart>& charts) const {
    std::vector<Seams> out(charts.size());
    std::unordered_map<std::uint64_t, std::uint32_t> open;  // chart of an edge seen once
    for (std::uint32_t c = 0; c < charts.size(); ++c) {
      for (const std::uint32_t t : charts[c].triangles) {
        for (std::size_t i = 0; i < 3; ++i) {
          const auto [low, high] = std::minmax(triangles_[t][i], triangles_[t][(i + 1) % 3]);
          const auto [at, fresh] = open.emplace(std::uint64_t{low} << 32 | high, c);
          if (fresh || at->second == c) continue;
          const double length = kiln::length(position_[high] - position_[low]);
          out[c][at->second] += length, out[at->second][c] += length;
        }
      }
    }
    return out;
  }

  /// Joins neighbours, those with the longest common border first, as long as the two together lie flat and their
  /// rectangle is not much larger than both of theirs.
  std::vector<Chart> join(std::vector<Chart> charts) const {
    std::vector<Seams> seams = seams_of(charts);
    std::priority_queue<Seam> queue;
    const auto push = [&](std::uint32_t a, std::uint32_t b) {
      queue.push({seams[a][b], std::min(a, b), std::max(a, b)});
    };
    for (std::uint32_t a = 0; a < charts.size(); ++a) {
      for (const auto& [b, length] : seams[a]) {
        if (a < b) push(a, b);
      }
    }
    while (!queue.empty()) {
      const auto [length, a, b] = queue.top();
      queue.pop();
      if (charts[a].triangles.empty() || charts[b].triangles.empty()) continue;
      Chart both;
      if (!lie_flat_together(charts[a], charts[b], both)) continue;
      const auto fresh = static_cast<std::uint32_t>(charts.size());
      charts.push_back(std::move(both));
      seams.emplace_back();
      for (const std::uint32_t old : {a, b}) {
        charts[old] = {};
        for (const auto& [other, common] : seams[old]) {
          if (other == a || other == b || charts[other].triangles.empty()) continue;
          seams[fresh][other] += common, seams[other][fresh] += common;
        }
        seams[old].clear();
      }
      for (const auto& [other, common] : seams[fresh]) push(fresh, other);
    }
    std::erase_if(charts, [](const Chart& c) { return c.triangles.empty(); });
    return charts;
  }

  bool lie_flat_together(const Chart& a, const Chart& b, Chart& both) const {
    constexpr double kLarger = 1.2;     // than both rectangles
    constexpr std::size_t kMost = 300;  // triangles: what is tried again and again stays small
    if (dot(a.normal, b.normal) < kSteepest || a.triangles.size() + b.triangles.size() > kMost) return false;
    both.triangles = a.triangles;
    both.triangles.insert(both.triangles.end(), b.triangles.begin(), b.triangles.end());
    set_frame(both.triangles, both);
    if (std::any_of(both.triangles.begin(), both.triangles.end(), [&](std::uint32_t t) { return is_steep(t, both); }))
      return false;
    shrink(both);
    const auto area = [](const Chart& c) { return (c.high.x - c.low.x) * (c.high.y - c.low.y); };
    if (area(both) > kLarger * (area(a) + area(b)) || folds(both.triangles, both)) return false;
    std::sort(both.triangles.begin(), both.triangles.end());
    return true;
  }

  void set_frame(std::span<const std::uint32_t> some, Chart& chart) const {
    Vec3d sum;
    for (const std::uint32_t t : some) sum += area_[t];
    chart.normal = normalized(sum);
    const Basis<double> basis = basis_around(chart.normal);
    chart.tangent = basis.x, chart.up = basis.y;
  }

  bool lies_flat(std::span<const std::uint32_t> some, Chart& chart) const {
    set_frame(some, chart);
    return std::none_of(some.begin(), some.end(), [&](std::uint32_t t) { return is_steep(t, chart); }) &&
           !folds(some, chart);
  }
  bool is_steep(std::uint32_t t, const Chart& chart) const {
    return dot(area_[t], chart.normal) < kSteepest * length(area_[t]);
  }

  /// A few steep triangles go aside; else the box is halved. Returns the size of the first part.
  std::size_t part(std::span<std::uint32_t> some, const Chart& chart) const {
    const auto steep =
        std::stable_partition(some.begin(), some.end(), [&](std::uint32_t t) { return !is_steep(t, chart); });
    const auto flat = static_cast<std::size_t>(steep - some.begin()), rest = some.size() - flat;
    return rest > 0 && 8 * rest <= some.size() ? flat : halve(some);
  }

  Flat flat(std::uint32_t t, const Chart& chart) const {
    Flat out;
    for (std::size_t c = 0; c < 3; ++c) {
      const Vec3d& p = position_[triangles_[t][c]];
      out[c] = {dot(chart.tangent, p), dot(chart.up, p)};
    }
    return out;
  }

  /// Whether two triangles overlap on the plane: pairs that meet in a cell of a grid are looked at.
  bool folds(std::span<const std::uint32_t> some, const Chart& chart) const {
    double area = 0;
    for (const std::uint32_t t : some) area += length(area_[t]);
    const double cell = 1.5 * std::sqrt(area / static_cast<double>(some.size())) + 1e-12;
    const double slack = 1e-9 * cell * cell;
    std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> grid;
    std::vector<Flat> flats;
    for (const std::uint32_t t : some) {
      const Flat f = flat(t, chart);
      const auto number = static_cast<std::uint32_t>(flats.size());
      flats.push_back(f);
      if (turn(f[0], f[1], f[2]) <= slack) continue;
      const auto index = [&](double x) { return static_cast<std::int64_t>(std::floor(x / cell)); };
      const auto [x0, x1] = std::minmax({f[0].x, f[1].x, f[2].x});
      const auto [y0, y1] = std::minmax({f[0].y, f[1].y, f[2].y});
      for (std::int64_t x = index(x0); x <= index(x1); ++x) {
        for (std::int64_t y = index(y0); y <= index(y1); ++y) {
          auto& list = grid[static_cast<std::uint64_t>(x) << 32 ^ (static_cast<std::uint64_t>(y) & 0xffffffffU)];
          for (const std::uint32_t other : list) {
            if (overlap(f, flats[other], slack)) return true;
          }
          list.push_back(number);
        }
      }
    }
    return false;
  }

  /// Puts the lower half of the centres along the longest side first. Returns its size.
  std::size_t halve(std::span<std::uint32_t> some) const {
    Vec3d low{HUGE_VAL, HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    for (const std::uint32_t t : some) {
      for (std::size_t a = 0; a < 3; ++a)
        low[a] = std::min(low[a], center_[t][a]), high[a] = std::max(high[a], center_[t][a]);
    }
    const Vec3d size = high - low;
    const std::size_t axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::size_t half = some.size() / 2;
    std::nth_element(some.begin(), some.begin() + static_cast<std::ptrdiff_t>(half), some.end(),
                     [&](std::uint32_t a, std::uint32_t b) {
                       const double ca = center_[a][axis], cb = center_[b][axis];
                       return ca != cb ? ca < cb : a < b;
                     });
    return half;
  }

  /// Turns the frame to the smallest rectangle of sixteen, lying rather than standing.
  void shrink(Chart& chart) const {
    constexpr int kTurns = 16;
    const Vec3d x = chart.tangent, y = chart.up;
    double best = HUGE_VAL;
    for (int i = 0; i < kTurns; ++i) {
      const double angle = 1.5707963267948966 * i / kTurns;
      Chart turned{.normal = chart.normal,
                   .tangent = x * std::cos(angle) + y * std::sin(angle),
                   .up = y * std::cos(angle) - x * std::sin(angle)};
      measure(chart, turned);
      const double area = (turned.high.x - turned.low.x) * (turned.high.y - turned.low.y);
      if (area >= best) continue;
      best = area;
      chart.tangent = turned.tangent, chart.up = turned.up, chart.low = turned.low, chart.high = turned.high;
    }
    if (chart.high.y - chart.low.y <= chart.high.x - chart.low.x) return;
    const Vec3d tangent = chart.tangent;  // a quarter turn
    chart.tangent = chart.up, chart.up = -tangent;
    measure(chart, chart);
  }
  void measure(const Chart& of, Chart& frame) const {
    frame.low = {HUGE_VAL, HUGE_VAL}, frame.high = {-HUGE_VAL, -HUGE_VAL};
    for (const std::uint32_t t : of.triangles) {
      for (const Point& p : flat(t, frame)) {
        frame.low = {std::min(frame.low.x, p.x), std::min(frame.low.y, p.y)};
        frame.high = {std::max(frame.high.x, p.x), std::max(frame.high.y, p.y)};
      }
    }
  }

  const std::vector<Vec3d>& position_;
  const std::vector<Triangle>& triangles_;
  std::vector<Vec3d> area_, center_;
};

constexpr int kPadding = 3;  // texels around a chart: its borders stay its own in the first two mip maps

/// Rectangles by falling height on shelves from the top down. False when they do not fit.
bool pack(Atlas& atlas, double density, const std::vector<std::uint32_t>& by_height) {
  int x = 0, y = 0, shelf = 0;
  for (const std::uint32_t i : by_height) {
    Chart& c = atlas.charts[i];
    const auto texels = [&](double length) {
      return static_cast<int>(std::ceil(length * density)) + 1 + 2 * atlas.padding;
    };
    c.width = texels(c.high.x - c.low.x), c.height = texels(c.high.y - c.low.y);
    if (c.width > atlas.side) return false;
    if (x + c.width > atlas.side) x = 0, y += shelf, shelf = 0;
    shelf = std::max(shelf, c.height);
    if (y + shelf > atlas.side) return false;
    c.x = x, c.y = y;
    x += c.width;
  }
  return true;
}

}  // namespace

Atlas make_charts(const std::vector<Vec3d>& position, const std::vector<Triangle>& triangles) {
  Atlas atlas{.charts = Splitter(position, triangles).run()};
  atlas.chart_of.resize(triangles.size());
  for (std::uint32_t c = 0; c < atlas.charts.size(); ++c) {
    for (const std::uint32_t t : atlas.charts[c].triangles) atlas.chart_of[t] = c;
  }
  return atlas;
}

bool place_charts(Atlas& atlas, int side) {
  atlas.side = side;
  std::vector<std::uint32_t> by_height(atlas.charts.size());
  std::iota(by_height.begin(), by_height.end(), 0U);
  double area = 0;
  for (const Chart& c : atlas.charts) area += (c.high.x - c.low.x) * (c.high.y - c.low.y);
  std::stable_sort(by_height.begin(), by_height.end(), [&](std::uint32_t a, std::uint32_t b) {
    return atlas.charts[a].high.y - atlas.charts[a].low.y > atlas.charts[b].high.y - atlas.charts[b].low.y;
  });
  // Padding shrinks where there are too many charts for it.
  for (atlas.padding = kPadding; !pack(atlas, 0, by_height); --atlas.padding) {
    if (atlas.padding == 1) return false;
  }
  // The largest density that fits, to a hundredth.
  double low = 0, high = 2 * side / std::sqrt(std::max(area, 1e-12));
  for (int i = 0; i < 24 && high - low > 0.01 * low; ++i) {
    const double middle = 0.5 * (low + high);
    (pack(atlas, middle, by_height) ? low : high) = middle;
  }
  atlas.density = low;
  pack(atlas, low, by_height);
  return true;
}

}  // namespace kiln
