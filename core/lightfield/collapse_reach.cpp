#include "core/lightfield/collapse_reach.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/mesh/pieces.h"
#include "core/mesh/triangle_distance.h"

namespace kiln {
namespace {

constexpr std::uint32_t kNone = SurfacePoints::kNone;

}  // namespace

CollapseReach::CollapseReach(const CollapseMesh& mesh, double max_reach) : mesh_(mesh) {
  if (std::isinf(max_reach)) return;
  const Mesh& m = mesh.mesh();
  place_.resize(mesh.points()), most_.assign(mesh.points(), std::numeric_limits<float>::infinity());
  reach_.assign(mesh.points(), 0.0F);
  next_.assign(mesh.points(), kNone), head_.assign(m.triangles.size(), kNone);
  const std::vector<float> diagonal = piece_diagonals(m);
  std::vector<bool> hung(mesh.points());
  for (std::uint32_t t = 0; t < m.triangles.size(); ++t) {
    for (const std::uint32_t v : m.triangles[t]) {
      const std::uint32_t p = mesh.point(v);
      most_[p] = std::min(most_[p], static_cast<float>(max_reach) * diagonal[v]);
      place_[p] = m.position[v];
      if (!hung[p]) hang(p, t);
      hung[p] = true;
    }
  }
}

void CollapseReach::hang(std::uint32_t point, std::uint32_t triangle) {
  next_[point] = head_[triangle];
  head_[triangle] = point;
}

bool CollapseReach::allows(const CollapsePlan& plan) {
  if (head_.empty()) return true;
  old_.clear(), new_.clear();
  std::vector<std::pair<std::uint32_t, FlatTriangle>> changed;
  const Vec3d place = to_double(plan.place);
  double moved = HUGE_VAL;  // squared
  const auto look_around = [&](std::uint32_t p, std::uint32_t other) {
    mesh_.around_point(p, [&](std::uint32_t t, std::uint32_t v, std::uint32_t a, std::uint32_t b) {
      const bool vanishes = mesh_.point(a) == other || mesh_.point(b) == other;
      if (vanishes && p == plan.kept) return;  // seen from the other end
      old_.push_back(t);
      const auto& position = mesh_.mesh().position;
      const Vec3d pa = to_double(position[a]), pb = to_double(position[b]);
      if (!vanishes) changed.emplace_back(t, FlatTriangle(place, pa, pb));
      moved = std::min(moved, nearest_place({to_double(position[v]), pa, pb}, place).squared);
    });
  };
  look_around(plan.gone, plan.kept);
  look_around(plan.kept, plan.gone);
  reach_then_ = double{std::max(reach_[plan.gone], reach_[plan.kept])} + std::sqrt(moved);
  if (reach_then_ > double{std::min(most_[plan.gone], most_[plan.kept])}) return false;
  for (const std::uint32_t t : old_) {
    for (std::uint32_t p = head_[t]; p != kNone; p = next_[p]) {
      const Vec3d at = to_double(place_[p]);
      double least = HUGE_VAL;
      std::uint32_t nearest = kNone;
      for (const auto& [triangle, now] : changed) {
        const double squared = nearest_place(now, at).squared;
        if (squared < least) least = squared, nearest = triangle;
      }
      if (!(std::sqrt(least) <= double{most_[p]})) return false;
      new_.emplace_back(p, nearest);
    }
  }
  return true;
}

void CollapseReach::take(const CollapsePlan& plan) {
  if (head_.empty()) return;
  reach_[plan.kept] = static_cast<float>(reach_then_);
  for (const std::uint32_t t : old_) head_[t] = kNone;
  for (const auto& [point, triangle] : new_) hang(point, triangle);
}

}  // namespace kiln
