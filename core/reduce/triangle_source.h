#pragma once
// Triangles that pass by, in the file's order, as often as they are asked for: the model itself is never held.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/base/threads.h"
#include "core/base/vec.h"

namespace kiln {

/// Corner c of triangle t is element 3 t + c of every array.
struct TriangleBatch {
  std::uint64_t first = 0;      // number of its first triangle
  std::vector<Vec3d> position;  // world
  std::vector<Vec3f> normal;    // unit, or zero where the file has none that is sound; empty where it has none at all
  std::vector<Vec3f> color;     // linear base colour; empty where everything is white
  /// Colour at corner 0 + u (corner 1 - corner 0) + v (corner 2 - corner 0) of a triangle, where colours are not linear
  /// in between: textures. Safe on any number of threads. Nothing: interpolate.
  std::function<Vec3f(std::size_t triangle, double u, double v)> texture;
  std::size_t triangles() const { return position.size() / 3; }
};

/// Batches have the same borders in every pass and on any number of threads.
inline constexpr std::size_t kBatchTriangles = 1U << 16;

enum class Detail { positions, all };

struct TriangleSource {
  /// Called once for each batch, in order, one call at a time.
  using Take = std::function<void(const TriangleBatch&)>;

  std::string name;             // of the file
  std::uint64_t bytes = 0;      // of the file
  std::uint64_t triangles = 0;  // as its header tells; polygons of more corners give more
  std::uint64_t vertices = 0;
  std::uint64_t memory_bytes = 0;  // held while it is open: decoded views and images
  std::uint64_t texels = 0;        // of the largest base colour texture
  bool normals = false, colors = false;

  /// One pass. Every number is checked: finite, and at most 1e18 in size. Fails with the code and the byte of what is
  /// wrong. Throws Cancelled when `threads` is stopped.
  std::function<Result<void>(Detail, const Take&, Threads&)> stream;
};

}  // namespace kiln
