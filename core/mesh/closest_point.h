#pragma once
// The nearest place on a surface: how a point of one mesh finds itself on another one of the same shape.

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>

#include "core/base/vec.h"
#include "core/mesh/mesh.h"

namespace kiln {

/// A place on a triangle: position = (1 - u - v) corner 0 + u corner 1 + v corner 2.
struct SurfaceMatch {
  std::uint32_t triangle = 0;
  double u = 0, v = 0;
  double distance = 0;  // to the query, in the mesh's own lengths
};

/// The vertex normals at a match, interpolated and made unit.
Vec3d match_normal(const Mesh&, const SurfaceMatch&);
Vec3d match_position(const Mesh&, const SurfaceMatch&);

/// A bounding-volume hierarchy over the triangles of a mesh, for nearest-point queries in double precision.
///
/// Normals of query and surface are compatible when the cosine between them is above kCompatibleCosine: less than 90
/// degrees, with a little room so that the quantised normal of a perpendicular wall does not pass by rounding.
/// Where several triangles are equally near (within kSamePlace: the two sides of an edge), the one whose normal agrees
/// best wins, then the lowest index: the answer does not depend on how the hierarchy was built.
///
/// Cost    build n log n, 40 bytes for each triangle; a query is about log n boxes
/// Repeat  same bits always; queries may run on any number of threads
/// Fails   never: degenerate triangles are the segments or points that they are
class ClosestPoint {
 public:
  static constexpr double kCompatibleCosine = 0.02;
  static constexpr double kSamePlace = 1e-7;  // about one float step of a unit-cube position

  /// Keeps a reference to the mesh, which must outlive it and not change.
  explicit ClosestPoint(const Mesh& mesh);
  ~ClosestPoint();
  ClosestPoint(ClosestPoint&&) noexcept;
  ClosestPoint& operator=(ClosestPoint&&) noexcept;

  /// The nearest place with a compatible normal, nothing when there is none within `reach`. A zero `normal` is
  /// compatible with all. `normal` need not be unit.
  std::optional<SurfaceMatch> query(const Vec3d& point, const Vec3d& normal,
                                    double reach = std::numeric_limits<double>::infinity()) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace kiln
