#pragma once
// Small scenes made from formulas.

#include <cstdint>

#include "core/base/random.h"
#include "core/scene/scene.h"

namespace kiln::testing {

/// A scene of one white, single-sided part without triangles.
Scene empty_scene();

/// Adds a part with a material of this albedo and returns its index.
std::uint32_t add_part(Scene&, const Vec3f& albedo, bool double_sided = false);

/// A parallelogram of columns x rows cells, two triangles each, with normal along cross(across, up).
void add_grid(Scene&, const Vec3f& corner, const Vec3f& across, const Vec3f& up, int columns, int rows,
              std::uint32_t part = 0);

/// The six faces of a box, each its own vertices; normals point out, or in when `inside_out`.
void add_box(Scene&, const Vec3f& low, const Vec3f& high, int cells, bool inside_out, std::uint32_t part = 0);

/// A sphere of rings x segments cells with smooth normals.
void add_sphere(Scene&, const Vec3f& center, float radius, int rings, std::uint32_t part = 0);

/// The paper's first figure: a 10 x 10 floor with a square column, 246 triangles, scaled to the unit cube.
Scene column_scene();

/// A torus knot over a floor (the paper's figure 5), scaled to the unit cube.
Scene knot_scene();

/// A room, closed but for one side, with two boxes in it.
Scene room_scene();

/// Triangles over random points of a coarse lattice: shared, repeated, non-manifold and degenerate ones among them;
/// some vertices are doubled, as on a normal seam.
Scene random_scene(std::uint64_t seed, int triangles);

}  // namespace kiln::testing
