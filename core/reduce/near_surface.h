#pragma once
// The nearest place on a small surface for very many points near it: a grid of candidate lists, a tree behind it.

#include <memory>
#include <optional>

#include "core/mesh/closest_point.h"
#include "core/mesh/mesh.h"

namespace kiln {

struct NearMatch {
  SurfaceMatch place;   // on a triangle that looks the same way, where there is one within half a cell; else on any
  double distance = 0;  // to the surface, whichever way it looks
};

/// Cells are as large as a mean triangle's edge is long. Where no triangle is within half a cell the tree is asked.
///
/// Cost     build: a list entry for each cell near each triangle, about 20 a triangle; a query reads one list
/// Memory   about 200 bytes a triangle
/// Repeat   same bits always; queries may run on any number of threads
class NearSurface {
 public:
  /// Keeps a reference to the mesh, which must outlive it and not change.
  explicit NearSurface(const Mesh&);
  ~NearSurface();
  /// `normal` is unit. Nothing where the mesh has no triangles.
  std::optional<NearMatch> query(const Vec3d& point, const Vec3d& normal) const;

 private:
  struct Cells;
  std::unique_ptr<Cells> cells_;
};

}  // namespace kiln
