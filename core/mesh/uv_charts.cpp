#include "core/mesh/uv_charts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/mesh/topology.h"

namespace kiln {
namespace {

constexpr int kDensitySteps = 40;  // of a bisection: a factor of 2^20 on either side of the first guess, to .01 %

/// Disjoint sets of vertices; the lowest is the name of its set.
class Sets {
 public:
  explicit Sets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0U); }
  std::uint32_t find(std::uint32_t v) {
    while (parent_[v] != v) v = parent_[v] = parent_[parent_[v]];
    return v;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = find(a), b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

/// Joins vertices of one part, position, normal and coordinate.
void join_equal(const Mesh& mesh, std::span<const std::uint32_t> used, const std::vector<std::uint32_t>& part,
                Sets& sets) {
  const std::vector<std::uint32_t> place = weld_by_position(mesh.position);
  const auto key = [&](std::uint32_t v) {
    const Vec3f& n = mesh.normal[v];
    const Vec2f& uv = mesh.uv1[v];
    return std::array<double, 7>{double(place[v]), double(part[v]), n.x, n.y, n.z, uv.x, uv.y};
  };
  std::vector<std::uint32_t> order(used.begin(), used.end());
  std::ranges::stable_sort(order, {}, key);
  for (std::size_t i = 1; i < order.size(); ++i) {
    if (key(order[i - 1]) == key(order[i])) sets.join(order[i - 1], order[i]);
  }
}

/// The rectangle of a chart in its own coordinates, and how many texels a coordinate takes at density 1.
struct Piece {
  Vec2d low{HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL};
  double area = 0, uv_area = 0;
  double stretch() const { return uv_area > 0 ? std::sqrt(area / uv_area) : 0; }
};

/// Texels between the first centre of a chart and its last, and where the first stands.
struct Slot {
  double width = 0, height = 0, x = 0, y = 0;
};

std::vector<Piece> pieces_of(const Mesh& mesh, const UvCharts& charts) {
  std::vector<Piece> out(charts.count);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (charts.of[t] == kNoChart) continue;
    Piece& piece = out[charts.of[t]];
    std::array<Vec2d, 3> uv;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2f& c = mesh.uv1[mesh.triangles[t][k]];
      uv[k] = {c.x, c.y};
      piece.low = {std::min(piece.low.x, uv[k].x), std::min(piece.low.y, uv[k].y)};
      piece.high = {std::max(piece.high.x, uv[k].x), std::max(piece.high.y, uv[k].y)};
    }
    piece.area += triangle_area(mesh, mesh.triangles[t]);
    piece.uv_area += 0.5 * std::abs(cross(uv[1] - uv[0], uv[2] - uv[0]));
  }
  return out;
}

/// Shelves, the highest charts first. False where the picture ends before the charts do.
bool place_on_shelves(const std::vector<Piece>& pieces, double density, int side, std::vector<Slot>& slots) {
  const double gap = kChartGap, most = side;
  const auto whole = [](double x) { return x > 0 ? std::max(1.0, std::round(x)) : 0; };
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const double stretch = pieces[i].stretch() * density;
    slots[i].width = whole((pieces[i].high.x - pieces[i].low.x) * stretch);
    slots[i].height = whole((pieces[i].high.y - pieces[i].low.y) * stretch);
  }
  std::vector<std::uint32_t> order(pieces.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::stable_sort(order, [&](std::uint32_t a, std::uint32_t b) { return slots[a].height > slots[b].height; });
  double x = 0, y = 0, shelf = 0;
  for (const std::uint32_t i : order) {
    Slot& slot = slots[i];
    const double width = slot.width + 1 + gap, height = slot.height + 1 + gap;
    if (x > 0 && x + width > most) x = 0, y += shelf, shelf = 0;
    if (x + width > most || y + height > most) return false;
    slot.x = x + gap / 2 + 0.5, slot.y = y + gap / 2 + 0.5;
    shelf = std::max(shelf, height);
    x += width;
  }
  return true;
}

}  // namespace

UvCharts find_uv_charts(const Mesh& mesh, std::span<const char> shown) {
  const std::size_t vertices = mesh.position.size();
  Sets sets(vertices);
  std::vector<std::uint32_t> part(vertices, kNoChart), used;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (shown[t] == 0) continue;
    const Triangle& c = mesh.triangles[t];
    sets.join(c[0], c[1]), sets.join(c[0], c[2]);
    for (const std::uint32_t v : c) part[v] = mesh.part[t];
  }
  for (std::uint32_t v = 0; v < vertices; ++v) {
    if (part[v] != kNoChart) used.push_back(v);
  }
  join_equal(mesh, used, part, sets);
  UvCharts out{.of = std::vector<std::uint32_t>(mesh.triangles.size(), kNoChart), .count = 0};
  std::vector<std::uint32_t> number(vertices, kNoChart);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (shown[t] == 0) continue;
    std::uint32_t& n = number[sets.find(mesh.triangles[t][0])];
    if (n == kNoChart) n = out.count++;
    out.of[t] = n;
  }
  return out;
}

std::optional<std::vector<Vec2f>> pack_uv_charts(const Mesh& mesh, const UvCharts& charts, int side) {
  const std::vector<Piece> pieces = pieces_of(mesh, charts);
  double area = 0;
  for (const Piece& piece : pieces) area += piece.area;
  std::vector<Slot> slots(pieces.size()), best;
  const auto fits = [&](double density) {
    const bool good = place_on_shelves(pieces, density, side, slots);
    if (good) best = slots;
    return good;
  };
  if (!fits(0)) return std::nullopt;
  double low = 0, high = area > 0 ? 4 * side / std::sqrt(area) : 0;
  for (int step = 0; step < kDensitySteps && high > 0; ++step) {
    const double middle = low > 0 ? 0.5 * (low + high) : 0.5 * high;
    (fits(middle) ? low : high) = middle;
    if (low > 0 && high < 1.0001 * low) break;
  }
  std::vector<Vec2f> out = mesh.uv1;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (charts.of[t] == kNoChart) continue;
    const Piece& piece = pieces[charts.of[t]];
    const Slot& slot = best[charts.of[t]];
    const Vec2d size = piece.high - piece.low;
    for (const std::uint32_t v : mesh.triangles[t]) {
      const Vec2d at{mesh.uv1[v].x - piece.low.x, mesh.uv1[v].y - piece.low.y};
      const double x = slot.x + (size.x > 0 ? at.x / size.x * slot.width : 0);
      const double y = slot.y + (size.y > 0 ? at.y / size.y * slot.height : 0);
      out[v] = {static_cast<float>(x / side), static_cast<float>(y / side)};
    }
  }
  return out;
}

}  // namespace kiln
