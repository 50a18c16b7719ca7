#pragma once
// The last pass: every triangle of the model finds its place on the reduced mesh, leaves its normal and colour in the
// texel there, and tells how far away it was.
//
// A triangle larger than a texel is cut into as many equal ones as it takes; each stands for its centre, weighted by
// its area. The way back, from the reduced mesh to the model, is measured at points of the reduced mesh that keep the
// distance of the nearest triangle seen so far.
//
// Paper    [Pacanowski06] section 2, step 3
// Memory   28 bytes a texel, 200 a reduced triangle, 20 MB of points
// Cost     about one microsecond a triangle
// Repeat   same bits for any thread count: texels are added to in the file's order
// Fails    as the source does

#include <cstdint>
#include <vector>

#include "core/mesh/mesh.h"
#include "core/reduce/charts.h"
#include "core/reduce/surface.h"
#include "core/reduce/triangle_source.h"

namespace kiln {

/// What fell into a texel.
struct Texel {
  Vec3f normal, color;  // sums, weighted
  float weight = 0;     // area, unit lengths squared
};

/// Distances between model and mesh, in parts of the diagonal of the model's box.
struct GeometricError {
  double rms = 0, most = 0;            // of the model's points from the mesh
  double rms_back = 0, most_back = 0;  // of the mesh's points from the model
  std::uint64_t points = 0, points_back = 0;
  std::uint64_t beyond = 0;  // points of the mesh with no triangle within reach: they count with the reach
};

/// A place of the mesh, and the model's normal there.
struct NormalProbe {
  std::uint32_t triangle = 0;
  float u = 0, v = 0;
  Vec3f normal;
  double weight = 0;  // area of the triangle that it is the middle of
};

struct Projection {
  std::vector<Texel> texels;  // of the atlas, row by row; none without one
  GeometricError error;
  std::vector<NormalProbe> probes;
};

struct Projecting {
  const Mesh& mesh;    // reduced, unit cube
  const Atlas* atlas;  // nullptr: only errors
  UnitFrame frame;
  double diagonal = 1;          // of the model's box, unit lengths
  std::uint64_t triangles = 0;  // of the model
  std::uint64_t seed = 0;
};

Result<Projection> project(const TriangleSource&, const Projecting&, Threads&);

}  // namespace kiln
