#pragma once
// Random points on a surface, uniform by area: where errors are measured, never at the vertices themselves.

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/random.h"
#include "core/base/vec.h"
#include "core/mesh/mesh.h"

namespace kiln {

struct SurfaceSample {
  std::uint32_t triangle = 0;
  float u = 0, v = 0;  // barycentrics of corners 1 and 2
};

/// `count` independent points; stratified over the running sum of areas, so that every large triangle is met. `density`
/// of each triangle, relative, where they shall not lie evenly; empty: all alike.
/// Empty when the mesh has no area.   Repeat  a function of mesh, count, seed and density.
std::vector<SurfaceSample> sample_surface(const Mesh&, std::size_t count, std::uint64_t seed,
                                          std::span<const double> density = {});

/// The direction of an eye, even over the half space of n. Takes two numbers.
Vec3d random_view(const Vec3d& n, Random&);

}  // namespace kiln
