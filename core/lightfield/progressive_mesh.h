#pragma once
// A lit mesh at every level of detail: a base, and vertex splits that bring back what simplify() took away.
//
// A split brings one or two triangles, and vertices: one that splits off another (two on a seam), and such as only
// those triangles have. Corners of some triangles turn from the vertex that was split to the new one, and vertices that
// the collapse had moved get their old attributes back. All of it is stored as it was and nothing is added up, so that
// every level has the same bits in any language.
//
// Paper    Hoppe 1996, with the light of Vanhoey et al. 2015, 4.5
// Error    of a level: SimplifyResult::error when it was reached; never rises from one level to the next

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/result.h"
#include "core/lightfield/simplify.h"

namespace kiln {

struct VertexSplit {
  std::uint32_t vertices = 1;             // new ones, at most 6: numbers follow on those there are
  std::uint32_t triangles = 1;            // the same
  std::uint32_t pairs = 1;                // the first one or two of them split off others (or new ones):
  std::array<std::uint32_t, 2> parent{};  // new vertex i off parent[i]
  std::uint32_t moved = 0, turned = 0;    // so many of the next elements of ProgressiveMesh's arrays
  float error = 0;                        // of the level before this split
};

struct ProgressiveMesh {
  std::uint32_t base_vertices = 0, base_triangles = 0;
  LitMesh all;  // vertices and triangles of the base, then of each split in turn; each as it is when it comes
  std::vector<VertexSplit> splits;
  std::vector<std::uint32_t> turned;        // 2 triangle + i: its corner at parent[i] becomes new vertex i
  std::vector<std::uint32_t> moved_vertex;  // there before or new: gets the attributes
  LitMesh moved;                            // of this one, which has vertices only

  std::size_t levels() const { return splits.size() + 1; }  // level k has k splits
};

/// From what simplify() recorded.
ProgressiveMesh progressive_mesh(const CollapseRecord&);

/// The mesh after the first `splits` splits. Level 0 is simplify()'s result, the last one its input (but for triangles
/// and vertices that simplify() drops, and for the order).
LitMesh at_level(const ProgressiveMesh&, std::size_t splits);
float level_error(const ProgressiveMesh&, std::size_t splits);
/// The finest level of at most so many triangles; 0 where there is none.
std::size_t level_of_triangles(const ProgressiveMesh&, std::size_t triangles);

/// The bytes of KILN_progressive_mesh, which README.md specifies. `rows`: a mean r-RF and what a weight of 1 adds to it,
/// each 3 count() numbers, at right angles to each other (core/prt/components.h); then light is weights of 16 bits, each
/// over its own range. None: float32. All else is as it was, bit by bit.
std::vector<std::uint8_t> encode_progressive(const ProgressiveMesh&, std::span<const float> rows = {});

/// Reads untrusted bytes; every count, index and number is checked. Fails with unsupported_version, truncated,
/// slot_count_mismatch, index_out_of_range or number_out_of_range, and a place like "split 17".
Result<ProgressiveMesh> decode_progressive(std::span<const std::uint8_t> bytes);

}  // namespace kiln
