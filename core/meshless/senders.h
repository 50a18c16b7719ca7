#pragma once
// Which point stands for the light that leaves a place: the nearest one, found in constant time for small triangles.
// Nearest  by the distance of equation 1 of points.h, |x - x_q| / (n . n_q): a point round a sharp corner is far.
// Reach    2 R of the finest level: farther points do not answer. Such places (inside solids, where points were
//          refused) have no sender, and light there must be followed by paths.
// Small triangles (no edge longer than R) are answered once for all, at their centroid.
// Repeat   a pure function of its arguments: of two equally near points the first counts

#include <cstdint>
#include <vector>

#include "core/base/threads.h"
#include "core/meshless/point_grid.h"
#include "core/meshless/points.h"
#include "core/prt/ray_origin.h"
#include "core/scene/scene.h"

namespace kiln {

class Senders {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffU;

  /// Keeps references to both.
  Senders(const Scene&, const PointHierarchy&, bool groups_by_part, Threads&);

  /// The point nearest to a site, or kNone.
  std::uint32_t nearest(const SurfaceSite&) const;
  /// The same at a hit on the lit side of a face.
  std::uint32_t at(std::uint32_t triangle, float u, float v) const;
  /// Where rays of a sender start.
  Vec3f origin(std::uint32_t sender) const { return ray_origin(transfer_point(points_.points[sender])); }

 private:
  static constexpr std::uint32_t kLookUp = 0xfffffffeU;
  SurfaceSite site_on(std::uint32_t triangle, float u, float v) const;

  const Scene& scene_;
  const PointHierarchy& points_;
  bool groups_by_part_;
  float finest_ = 0;
  PointGrid grid_;
  std::vector<std::uint32_t> of_face_;  // of each triangle: its sender, kNone or kLookUp
};

}  // namespace kiln
