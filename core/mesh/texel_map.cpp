#include "core/mesh/texel_map.h"

#include <algorithm>
#include <cmath>

#include "core/base/expects.h"

namespace kiln {
namespace {

constexpr double kWell = 0.02;    // texels inside of every edge: what rounds to either side of one is no overlap
constexpr double kReach = 1.415;  // texels: bilinear filtering reads up to one away along both axes

/// Barycentrics of the nearest place of a triangle, and how far it is.
struct Nearest {
  double u = 0, v = 0, squared = HUGE_VAL;
  bool inside = false, well = false;
};

Nearest nearest_place(const std::array<Vec2d, 3>& c, const Vec2d& p) {
  const Vec2d e1 = c[1] - c[0], e2 = c[2] - c[0], d = p - c[0];
  const double twice = cross(e1, e2);
  if (twice != 0) {
    const double u = cross(d, e2) / twice, v = cross(e1, d) / twice;
    if (u >= 0 && v >= 0 && u + v <= 1) {
      const double size = std::abs(twice);
      const double edge =
          std::min({v * size / length(e1), u * size / length(e2), (1 - u - v) * size / length(c[2] - c[1])});
      return {u, v, 0, true, edge > kWell};
    }
  }
  Nearest best;
  for (std::size_t from = 0; from < 3; ++from) {
    const std::size_t to = (from + 1) % 3;
    const Vec2d edge = c[to] - c[from];
    const double size = dot(edge, edge);
    const double t = size > 0 ? std::clamp(dot(p - c[from], edge) / size, 0.0, 1.0) : 0.0;
    const Vec2d off = p - (c[from] + edge * t);
    if (!(dot(off, off) < best.squared)) continue;
    std::array<double, 3> weight{};
    weight[from] = 1 - t, weight[to] = t;
    best = {weight[1], weight[2], dot(off, off), false, false};
  }
  return best;
}

/// Corners of a triangle in texels, whose centres are whole numbers.
std::array<Vec2d, 3> corners_of(const Mesh& mesh, std::uint32_t triangle, int side) {
  std::array<Vec2d, 3> c;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec2f& uv = mesh.uv1[mesh.triangles[triangle][k]];
    c[k] = {double{uv.x} * side - 0.5, double{uv.y} * side - 0.5};
  }
  return c;
}

/// Calls f(texel) for those of the picture within `margin` of the triangle's box, row by row.
template <class F>
void for_box(const std::array<Vec2d, 3>& c, double margin, int side, const F& f) {
  const auto bound = [&](double x) { return static_cast<int>(std::clamp(x, -1.0, double(side))); };
  const auto [left, right] = std::minmax({c[0].x, c[1].x, c[2].x});
  const auto [top, bottom] = std::minmax({c[0].y, c[1].y, c[2].y});
  const int last_x = std::min(side - 1, bound(std::ceil(right + margin)));
  const int last_y = std::min(side - 1, bound(std::ceil(bottom + margin)));
  for (int y = std::max(0, bound(std::floor(top - margin))); y <= last_y; ++y) {
    for (int x = std::max(0, bound(std::floor(left - margin))); x <= last_x; ++x) f(x, y);
  }
}

struct Claim {
  std::uint32_t triangle = kNoChart;
  float u = 0, v = 0, squared = HUGE_VALF;
  enum : std::uint8_t { outside, edge, well, within, across } how = outside;
};

void claim(const Nearest& found, std::uint32_t triangle, const UvCharts& charts, Claim& texel) {
  const bool apart = found.well && texel.how >= Claim::well;
  if (apart) {
    const bool same = charts.of[texel.triangle] == charts.of[triangle];
    texel.how = same ? std::max(texel.how, Claim::within) : Claim::across;
  }
  const auto squared = static_cast<float>(found.squared);
  if (apart || !(squared < texel.squared || (found.well && texel.how == Claim::edge))) return;
  texel = {triangle, static_cast<float>(found.u), static_cast<float>(found.v), squared,
           found.well     ? Claim::well
           : found.inside ? Claim::edge
                          : Claim::outside};
}

}  // namespace

TexelMap map_texels(const Mesh& mesh, const UvCharts& charts, int side) {
  EXPECTS(side >= 1 && side <= 32768);
  const auto width = static_cast<std::size_t>(side);
  std::vector<Claim> texels(width * width);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    if (charts.of[t] == kNoChart) continue;
    const std::array<Vec2d, 3> c = corners_of(mesh, t, side);
    for_box(c, 1, side, [&](int x, int y) {
      const Nearest found = nearest_place(c, {double(x), double(y)});
      if (found.squared <= kReach * kReach)
        claim(found, t, charts, texels[static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)]);
    });
  }
  TexelMap out{.side = side, .places = {}, .inside = 0, .within = 0, .across = 0};
  for (std::size_t i = 0; i < texels.size(); ++i) {
    const Claim& c = texels[i];
    if (c.triangle == kNoChart) continue;
    out.places.push_back({static_cast<std::uint32_t>(i), c.triangle, c.u, c.v, c.how != Claim::outside});
    out.inside += c.how != Claim::outside ? 1 : 0;
    out.within += c.how == Claim::within ? 1 : 0;
    out.across += c.how == Claim::across ? 1 : 0;
  }
  return out;
}

TexelParts::TexelParts(const Mesh& mesh, const UvCharts& charts, const TexelMap& map,
                       std::span<const std::uint32_t> wanted)
    : mesh_(mesh), map_(map), triangles_(wanted.size()) {
  const auto width = static_cast<std::size_t>(map.side);
  std::vector<std::uint32_t> number(wanted.empty() ? 0 : width * width, kNoChart), chart;
  for (const std::uint32_t p : wanted) {
    const TexelPlace& at = map.places[p];
    number[at.texel] = static_cast<std::uint32_t>(texel_.size());
    texel_.push_back(at.texel);
    chart.push_back(charts.of[at.triangle]);
  }
  if (wanted.empty()) return;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    if (charts.of[t] == kNoChart) continue;
    for_box(corners_of(mesh, t, map.side), 0.5, map.side, [&](int x, int y) {
      const std::uint32_t k = number[static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)];
      if (k != kNoChart && chart[k] == charts.of[t]) triangles_[k].push_back(t);
    });
  }
}

std::vector<TexelPlace> TexelParts::of(std::size_t k, int side) const {
  const auto width = static_cast<std::uint32_t>(map_.side);
  const std::uint32_t column = texel_[k] % width, row = texel_[k] / width;
  std::vector<TexelPlace> out;
  for (int part = 0; part < side * side; ++part) {
    const int i = part % side, j = part / side;
    const Vec2d at{column + (i + 0.5) / side - 0.5, row + (j + 0.5) / side - 0.5};
    for (const std::uint32_t t : triangles_[k]) {
      const Nearest found = nearest_place(corners_of(mesh_, t, map_.side), at);
      if (!found.inside) continue;
      out.push_back({texel_[k], t, static_cast<float>(found.u), static_cast<float>(found.v), true});
      break;
    }
  }
  return out;
}

Bilinear bilinear_at(const Vec2f& uv, int side) {
  const auto axis = [&](float at) {
    const double x = std::clamp(double{at} * side - 0.5, 0.0, double(side - 1));
    const int first = std::min(static_cast<int>(x), std::max(0, side - 2));
    return std::pair{first, static_cast<float>(x - first)};
  };
  const auto [x, fx] = axis(uv.x);
  const auto [y, fy] = axis(uv.y);
  const int right = std::min(x + 1, side - 1), below = std::min(y + 1, side - 1);
  const auto number = [&](int i, int j) {
    return static_cast<std::uint32_t>(j) * static_cast<std::uint32_t>(side) + static_cast<std::uint32_t>(i);
  };
  return {{number(x, y), number(right, y), number(x, below), number(right, below)},
          {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy}};
}

}  // namespace kiln
