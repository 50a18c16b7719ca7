#pragma once
// Parts and their places in the world become one mesh in the unit cube.

#include <vector>

#include "core/artifact/affine.h"
#include "core/artifact/findings.h"
#include "core/artifact/import.h"
#include "core/artifact/raw_part.h"

namespace kiln {

/// One run of the result: `part` at each of `instances`.
struct PlacedPart {
  std::size_t part = 0;  // index of a cleaned RawPart
  std::string name;
  std::vector<Affine> instances;
};

/// Sets frame, mesh and parts of the scene, and the r-RFs of its vertices where the parts have radiance: RFs turn with
/// their instances, and are reflected about the normals that come out. The field's degree is given. Instances are
/// expanded in order; those that mirror get their winding turned. Positions are computed in double from matrix and file
/// value, centred, scaled, then rounded to float once. Fails with position_out_of_range, scene_too_large (says
/// predicted and allowed bytes and triangles) and empty_scene.
void assemble(const std::vector<RawPart>&, const std::vector<PlacedPart>&, const ImportLimits&, LitScene&, Findings&);

/// Bytes of the finished mesh for so many vertices and triangles: an upper bound with every attribute present.
constexpr std::uint64_t mesh_bytes(std::uint64_t vertices, std::uint64_t triangles) {
  return vertices * 72 + triangles * 16;
}

/// Fails with scene_too_large when the expanded scene passes the limits; `row` bytes of radiance a vertex.
void check_expanded_size(std::uint64_t vertices, std::uint64_t triangles, std::uint64_t row, const ImportLimits&,
                         Findings&);

}  // namespace kiln
