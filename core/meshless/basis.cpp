#include "core/meshless/basis.h"

#include <algorithm>
#include <cmath>

#include "core/base/expects.h"
#include "core/mesh/topology.h"
#include "core/meshless/point_grid.h"

namespace kiln {
namespace {

constexpr std::size_t kBlock = 256;
constexpr float kWholeScene = 1.7320508F * 1.01F;  // the unit cube's diagonal, and a little
constexpr float kLeastWeight = 1e-12F;             // a sum of weights below is none: all were rounded away

bool compatible(const SurfaceSite& a, const SurfaceSite& b) {
  return a.group == b.group && dot(a.normal, b.normal) > 0;
}

/// Side of the cells in which k points lie, were they spread evenly over a box's surface: any size is right.
float cell_size(std::span<const SurfaceSite> points, int neighbours) {
  Vec3f low{1, 1, 1}, high{-1, -1, -1};
  for (const SurfaceSite& p : points) {
    for (std::size_t k = 0; k < 3; ++k)
      low[k] = std::min(low[k], p.position[k]), high[k] = std::max(high[k], p.position[k]);
  }
  const Vec3f size = high - low;
  const float area = 2 * (size.x * size.y + size.y * size.z + size.z * size.x);
  return std::max(1e-5F, std::sqrt(area * static_cast<float>(neighbours) / static_cast<float>(points.size() + 1)));
}

/// r_j of the points, each among all of them.
std::vector<float> neighbour_radii(std::span<const SurfaceSite> points, int neighbours, Threads& threads) {
  const float cell = points.empty() ? 1.0F : cell_size(points, neighbours);
  PointGrid grid(cell);
  for (std::uint32_t i = 0; i < points.size(); ++i) grid.add(i, points[i].position);
  std::vector<float> radii(points.size());
  const auto k = static_cast<std::size_t>(neighbours);
  threads.for_blocks(points.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    std::vector<float> found;
    for (std::size_t j = begin; j < end; ++j) {
      radii[j] = kWholeScene;
      for (float reach = 0.75F * cell; reach < 4 * kWholeScene; reach *= 1.6F) {
        found.clear();
        grid.near(points[j].position, reach, [&](std::uint32_t i, float d2) {
          if (i != j && compatible(points[i], points[j])) found.push_back(d2);
        });
        if (found.size() < k) continue;
        std::nth_element(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(k - 1), found.end());
        // Points that lie on one another still get a function with an inside.
        radii[j] = std::max(std::sqrt(found[k - 1]), 1e-6F);
        break;
      }
    }
  });
  return radii;
}

}  // namespace

MeshlessBasis::MeshlessBasis(std::span<const SurfaceSite> points, std::span<const std::uint32_t> level_end,
                             Threads& threads, int neighbours)
    : sites_(points.begin(), points.end()) {
  EXPECTS(neighbours >= 1 && (level_end.empty() ? points.empty() : level_end.back() == points.size()));
  std::uint32_t begin = 0;
  for (const std::uint32_t end : level_end) {
    EXPECTS(begin <= end && end <= points.size());
    const std::vector<float> radii = neighbour_radii(points.subspan(begin, end - begin), neighbours, threads);
    std::vector<Ball> balls;
    for (std::uint32_t j = begin; j < end; ++j) balls.push_back({points[j].position, radii[j - begin]});
    radius_.insert(radius_.end(), radii.begin(), radii.end());
    levels_.push_back({begin, end, SphereTree(balls)});
    begin = end;
  }
}

bool MeshlessBasis::level_terms(const Level& level, const SurfaceSite& p, std::vector<BasisTerm>& out) const {
  const std::size_t first = out.size();
  float sum = 0;
  level.tree.containing(p.position, [&](std::uint32_t i, float d2) {
    const std::uint32_t j = level.begin + i;
    if (sites_[j].group != p.group) return;
    const float w = falloff(std::sqrt(d2) / radius_[j]) * std::max(0.0F, dot(p.normal, sites_[j].normal));
    if (w <= 0) return;
    out.push_back({j, w});
    sum += w;
  });
  if (!(sum > kLeastWeight)) {
    out.resize(first);
    return false;
  }
  for (std::size_t i = first; i < out.size(); ++i) out[i].value /= sum;
  return true;
}

std::uint32_t MeshlessBasis::nearest_of(const Level& level, const SurfaceSite& p) const {
  std::uint32_t best = kNoFunction;
  float least = 0;
  for (std::uint32_t j = level.begin; j < level.end; ++j) {
    if (!compatible(sites_[j], p)) continue;
    const Vec3f d = sites_[j].position - p.position;
    const float d2 = dot(d, d);
    if (best == kNoFunction || d2 < least) best = j, least = d2;
  }
  return best;
}

bool MeshlessBasis::terms_of(std::size_t level, const SurfaceSite& p, std::vector<BasisTerm>& out) const {
  return level_terms(levels_[level], p, out);
}

std::size_t MeshlessBasis::level_of(std::uint32_t function) const {
  const auto above = std::ranges::upper_bound(levels_, function, {}, &Level::end);
  return static_cast<std::size_t>(above - levels_.begin());
}

std::uint32_t MeshlessBasis::nearest(const SurfaceSite& p, std::size_t level) const {
  EXPECTS(level < levels_.size());
  return nearest_of(levels_[level], p);
}

Cover MeshlessBasis::terms(const SurfaceSite& p, std::size_t levels, std::vector<BasisTerm>& out) const {
  Cover cover = Cover::none;
  for (std::size_t i = 0; i < std::min(levels, levels_.size()); ++i) {
    if (level_terms(levels_[i], p, out)) {
      cover = Cover::functions;
    } else if (cover == Cover::none) {
      const std::uint32_t j = nearest_of(levels_[i], p);
      if (j == kNoFunction) continue;
      out.push_back({j, 1});
      cover = Cover::nearest;
    }
  }
  return cover;
}

Vec3f MeshlessBasis::evaluate(std::span<const Vec3f> coefficients, const SurfaceSite& p, std::size_t levels) const {
  EXPECTS(coefficients.size() == sites_.size());
  std::vector<BasisTerm> found;
  terms(p, levels, found);
  Vec3f sum;
  for (const BasisTerm& t : found) sum += coefficients[t.function] * t.value;
  return sum;
}

std::vector<Vec3f> MeshlessBasis::coefficients(std::span<const Vec3f> values, Threads& threads) const {
  EXPECTS(values.size() == sites_.size());
  std::vector<Vec3f> out(values.size());
  for (std::size_t i = 0; i < levels_.size(); ++i) {
    const Level& level = levels_[i];
    threads.for_blocks(level.end - level.begin, kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) {
        const std::size_t j = level.begin + k;
        out[j] = values[j] - evaluate(out, sites_[j], i);
      }
    });
  }
  return out;
}

}  // namespace kiln
