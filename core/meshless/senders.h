#pragma once
// Which point stands for the light that leaves a place: the nearest one that the place sees, by table.
// Nearest  by the distance of equation 1 of points.h, |x - x_q| / (n . n_q): a point round a sharp corner is far.
// Sight    in_sight.h: what a wall or a fold of cloth parts does not answer for what is behind it.
// Reach    2 R of the finest level: farther points do not answer, nor do more than the 32 nearest of those within
//          reach. Places without a sender must be followed by paths.
// Table    each triangle is cut into cells of at most R x R along two of its edges, and a cell answers once for all, as
//          at its centre: a hit costs one read. Where the centre's answer is not seen from near the cell's corners,
//          where a gap begins or ends in the cell (cover.h), and on triangles for which cells take far more than their
//          area deserves (blunt needles), each hit looks for itself.
// Backs    of double-sided faces have cells of their own where points stand on some.
// Memory   12 bytes a triangle, 4 a cell: about three cells a point
// Repeat   a pure function of its arguments: of two equally near points the first counts

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/threads.h"
#include "core/meshless/point_grid.h"
#include "core/meshless/points.h"
#include "core/scene/scene.h"

namespace kiln {

class Senders {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffU;
  static constexpr float kReach = 2;  // of R

  /// Keeps references to tracer and points.
  Senders(const Tracer&, const PointHierarchy&, Threads&);

  /// Takes in points that were added to the hierarchy behind those known so far: they answer where none did.
  void add_new(Threads&);

  /// The nearest point within reach that the site sees, or kNone.
  std::uint32_t nearest(const SurfaceSite&) const;
  /// The same at a hit on the lit side of a face.
  std::uint32_t at(std::uint32_t triangle, float u, float v) const;
  /// The same on the back of a double-sided face; kNone where no points stand on backs.
  std::uint32_t behind(std::uint32_t triangle, float u, float v) const;
  const SurfaceSite& site(std::uint32_t sender) const { return points_.points[sender].site; }
  void prefetch(std::uint32_t triangle) const { __builtin_prefetch(&faces_[triangle]); }

 private:
  /// Cells (i, j) of a triangle along the edges from `corner` to the next and to the one before it.
  struct Face {
    std::uint32_t begin = 0;
    std::uint16_t columns = 0, rows = 0;  // 0: look up
    std::uint8_t corner = 0;
  };
  Face cut(std::uint32_t triangle) const;
  /// An answer, and whether there was any point to ask.
  struct Search {
    std::uint32_t sender = kNone;
    bool any = false;
  };
  struct Candidate {
    float scaled = 0;  // d^2 / cos^2
    std::uint32_t point = kNone;
    bool operator<(const Candidate& o) const { return scaled != o.scaled ? scaled < o.scaled : point < o.point; }
  };
  void fill(std::uint32_t triangle, const PointGrid& fresh);
  bool any_near(const PointGrid&, const Vec3f&) const;
  SurfaceSite site_in_cell(std::uint32_t triangle, std::uint32_t i, std::uint32_t j, const Vec2f& at) const;
  std::uint32_t answer_of_cell(std::uint32_t triangle, std::uint32_t i, std::uint32_t j, bool back) const;
  template <std::size_t most>
  std::size_t near(const SurfaceSite&, float reach, std::array<Candidate, most>& first) const;
  Search search(const SurfaceSite&) const;
  SurfaceSite site_on(std::uint32_t triangle, float u, float v, bool back) const;
  /// The site with its group (cover.h), which the two above leave open.
  SurfaceSite grouped(SurfaceSite) const;
  std::uint32_t cell_at(const Face&, float u, float v) const;

  static constexpr std::uint32_t kLook = 0xfffffffeU;  // of a cell: each hit looks for itself

  const Tracer& tracer_;
  const Scene& scene_;
  const PointHierarchy& points_;
  bool backs_ = false;
  float finest_ = 0;
  PointGrid grid_;
  std::vector<Face> faces_;
  std::vector<std::uint32_t> cells_, back_cells_;
};

}  // namespace kiln
