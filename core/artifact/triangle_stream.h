#pragma once
// A file on disk as a stream of triangles (core/reduce/triangle_source.h): for models larger than memory.

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "core/artifact/findings.h"
#include "core/artifact/import.h"
#include "core/reduce/triangle_source.h"

namespace kiln {

struct StreamOptions {
  std::string spill_folder;                        // where vertices of ASCII files are put aside
  std::uint64_t max_memory_bytes = 4096ull << 20;  // of the whole job: a quarter of it may be decoded views and images
};

/// PLY (ASCII and binary, of any size), GLB and glTF with what import_scene reads, to 4 GiB; told apart by content. The
/// files are shared by the source. Rows of binary vertices, accessors and indices are read where they lie; ASCII
/// vertices and rows of lists are written into a spill file once; compressed primitives are decoded whole, one at a
/// time; textures of base colours are decoded and held.
/// Warnings of what a reduction does not carry along go to `findings`, faults too (and the source is empty then).
TriangleSource open_triangles(const SceneFiles&, const StreamOptions&, Findings& findings);

/// For open_triangles alone.
TriangleSource open_ply(const SceneFiles&, const StreamOptions&, Findings&);
TriangleSource open_gltf_triangles(const SceneFiles&, const StreamOptions&, Findings&);

/// The corners of one batch before their values are fetched: three vertex numbers for each triangle.
struct CornerBatch {
  std::uint64_t first = 0;
  std::vector<std::uint32_t> corners;
};

/// Calls `fetch(corner, i)` for all of a batch's corners on all threads; the first of them in order, if any, for which
/// it returns false.
std::optional<std::size_t> fetch_corners(const CornerBatch&, Threads&,
                                         const std::function<bool(std::uint32_t vertex, std::size_t i)>& fetch);

/// Numbers that no step chokes on: finite, at most 1e18 in size.
inline bool is_sane_position(const Vec3d& p) {
  return std::abs(p.x) <= 1e18 && std::abs(p.y) <= 1e18 && std::abs(p.z) <= 1e18;
}

}  // namespace kiln
