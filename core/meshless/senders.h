#pragma once
// Which point stands for the light that leaves a place: the nearest one, by table.
// Nearest  by the distance of equation 1 of points.h, |x - x_q| / (n . n_q): a point round a sharp corner is far.
// Reach    2 R of the finest level: farther points do not answer. Such places (inside solids, where points were
//          refused) have no sender, and light there must be followed by paths.
// Table    each triangle is cut into cells of at most R x R along two of its edges, and a cell answers once for all, as
//          at its centre: a hit costs one read. Only triangles for which that takes far more cells than their area
//          deserves (blunt needles) are looked up.
// Backs    of double-sided faces have cells of their own where points stand on both sides.
// Memory   12 bytes a triangle, 4 a cell: about three cells a point
// Repeat   a pure function of its arguments: of two equally near points the first counts

#include <cstdint>
#include <functional>
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
  Senders(const Scene&, const PointHierarchy&, const PointPlacement&, Threads&);

  /// The point nearest to a site, or kNone.
  std::uint32_t nearest(const SurfaceSite&) const;
  /// The nearest within reach that `suits`, or kNone. Asks nearer ones first, eight at most.
  std::uint32_t nearest(const SurfaceSite&, const std::function<bool(std::uint32_t)>& suits) const;
  /// The same at a hit on the lit side of a face.
  std::uint32_t at(std::uint32_t triangle, float u, float v) const;
  /// The same on the back of a double-sided face; kNone where no points stand on backs.
  std::uint32_t behind(std::uint32_t triangle, float u, float v) const;
  const SurfaceSite& site(std::uint32_t sender) const { return points_.points[sender].site; }
  void prefetch(std::uint32_t triangle) const { __builtin_prefetch(&faces_[triangle]); }
  /// Where rays of a sender start.
  Vec3f origin(std::uint32_t sender) const { return ray_origin(transfer_point(points_.points[sender])); }

 private:
  /// Cells (i, j) of a triangle along the edges from `corner` to the next and to the one before it.
  struct Face {
    std::uint32_t begin = 0;
    std::uint16_t columns = 0, rows = 0;  // 0: look up
    std::uint8_t corner = 0;
  };
  Face cut(std::uint32_t triangle) const;
  void fill(std::uint32_t triangle);
  SurfaceSite site_on(std::uint32_t triangle, float u, float v) const;
  std::uint32_t cell_at(const Face&, float u, float v) const;

  const Scene& scene_;
  const PointHierarchy& points_;
  bool groups_by_part_, both_sides_;
  float finest_ = 0;
  PointGrid grid_;
  std::vector<Face> faces_;
  std::vector<std::uint32_t> cells_, back_cells_;
};

}  // namespace kiln
