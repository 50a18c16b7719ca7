#pragma once
// How far lit meshes are from each other, and simplifiers of others, for tests/bench/light_field.cpp.

#include <optional>

#include "core/base/threads.h"
#include "core/lightfield/simplify.h"

namespace kiln::bench {

/// How far one lit mesh is from another of the same shape, at random points of `truth` and the nearest of `found`.
struct LightFieldError {
  double light = 0;     // sqrt(mean d^2 / mean |L|^2), d of eq. 5 between interpolated r-RFs, at the nearest places
  double texture = 0;   // RMS shift of uv0 along the surface, each cut at 1 %: % of the diagonal
  double distance = 0;  // RMS both ways, % of the diagonal of the box
};
LightFieldError compare(const LitMesh& truth, const LitMesh& found);

/// meshoptimizer's WASM build with band 0 as colours; nothing where there is no node or package.
std::optional<LitMesh> simplify_meshopt(const LitMesh&, std::size_t triangles, float weight);

/// Extended quadrics of position and mean colour (Garland and Heckbert 1998), collapsed under the same guards as ours.
/// The radiance functions are carried along as ours are. `weight`: of colours relative to the field's RMS, where
/// lengths are those of the unit cube.
LitMesh simplify_colour_qem(const LitMesh&, std::size_t triangles, Collapse, double weight);

}  // namespace kiln::bench
