#pragma once
// Points on the surfaces of a scene: a hierarchical Poisson-disk distribution, coarse to fine.
//   a point is refused while an earlier one q of its group has  |x - x_q| < R max(0, n . n_q)                    (1)
// Level 0 is filled at R; each next level halves R and fills what the levels before left open.
// Paper   Lehtinen et al. 2007, section 6.1.
// Side    points stand on the side that vertices have light for (GatherFaces): of double-sided faces that of the vertex
//         normals, of others the front. A point whose normal's ray first meets a back is taken to be inside a solid and
//         refused. On the first `both_sides` levels double-sided faces have points on their backs as well; then only
//         the back of a single-sided face tells the inside of a solid.
// Gaps    (cover.h) are groups of their own: there, too, only the back of a single-sided face refuses a point, and
//         covered backs of double-sided faces have points on all levels. Which triangles may be covered is known from
//         one look for each R^2 of the finest level; what that misses is left to demand.h.
// Differs A level ends after a number of proposals that follows from the area: kProposals A / R^2. The paper waits for
//         1000 rejections in a row, which takes seconds on fine levels and no known time on crumpled surfaces. Of a
//         smooth surface .5 % is then farther than R from every point and nothing farther than 1.5 R (measured).
// Cost    (4/3) kProposals A / R_finest^2 proposals, one after the other; one ray for each point.
// Repeat  a pure function of scene and parameters.   Fails   never; a surface without area has no points

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/threads.h"
#include "core/base/vec.h"
#include "core/prt/gather_faces.h"
#include "core/prt/transfer_point.h"
#include "core/trace/tracer.h"

namespace kiln {

/// A place with a side: where functions are asked for.
struct SurfaceSite {
  Vec3f position, normal;   // unit-cube coordinates; unit shading normal
  std::uint32_t group = 0;  // in a gap or not (cover.h): functions of one group do not reach into the other
};

struct MeshlessPoint {
  SurfaceSite site;
  Vec3f face_normal;           // on the side of the point
  std::uint32_t triangle = 0;  // kNoFace: of a vertex (demand.h)
  float u = 0, v = 0;
  bool behind = false;  // on the back of a double-sided face
  bool pocket = false;  // its normal's ray first meets a back (demand.h)
};

struct PointPlacement {
  float radius = 0;              // R of level 0; 0: auto, so that all levels together have about `wanted` points
  int levels = 0;                // 0: auto
  std::uint64_t wanted = 0;      // points on all levels where the radius is auto; 0: auto
  int both_sides = 0;            // levels with points on both sides of double-sided faces
  std::vector<bool> parts = {};  // of the scene, those that get points; empty: all
  std::uint64_t seed = 0;
};

inline constexpr int kMaxPointLevels = 16;
inline constexpr int kProposals = 12;  // for each R^2 of area

struct PointHierarchy {
  std::vector<MeshlessPoint> points;     // level by level
  std::vector<std::uint32_t> level_end;  // level i has the points level_end[i - 1] .. level_end[i] - 1
  std::vector<float> radius;             // R of each level
  float cover = 0;                       // R of the finest: what is nearer above a place covers it (cover.h)

  bool demanded = false;  // the last level is one of points that were asked for (demand.h)

  std::size_t levels() const { return level_end.size(); }
  std::size_t placed_levels() const { return levels() - (demanded ? 1 : 0); }
  std::uint32_t begin(std::size_t level) const { return level == 0 ? 0 : level_end[level - 1]; }
};

/// `radius` and `levels` filled in: half as many points as vertices, at least 8192 and at most 262144; five levels.
PointPlacement resolve(const PointPlacement&, const Scene&);

/// About how many points this much area takes down to radius R: .7 A / R^2 on smooth surfaces (measured). Callers
/// refuse what would be too many: place_points goes through with any number below 2^31.
double expected_points(double area, double radius);

/// Of the parts that get points.
double placed_area(const PointPlacement&, const Scene&);

/// How many points there are on each level, and how many of some.
std::vector<std::uint32_t> level_sizes(const PointHierarchy&);
std::vector<std::uint32_t> count_by_level(const PointHierarchy&, std::span<const std::uint32_t> some);

/// Points along the Morton curve of their places.
std::vector<std::uint32_t> along_curve(const PointHierarchy&, std::span<const std::uint32_t> some);

PointHierarchy place_points(const Tracer&, const GatherFaces&, const PointPlacement&, Threads&);

/// The point of a triangle at barycentrics (u, v) of corners 1 and 2, of no group yet; `behind`: on the back of the
/// face.
MeshlessPoint point_on(const Scene&, std::uint32_t triangle, const Vec2f& uv, bool behind);

/// Whether the first thing in the direction of the normal is a back (`both_sides`: of a single-sided face): the site is
/// inside a solid.
bool is_enclosed(const Tracer&, const GatherFaces&, const TransferPoint&, bool both_sides = false);

/// What ray_origin takes.
TransferPoint transfer_point(const MeshlessPoint&);

}  // namespace kiln
