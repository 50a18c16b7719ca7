#pragma once
// Well-distributed points and the maps that carry them from the unit square to where rays are wanted.

#include <cstdint>

#include "core/base/vec.h"

namespace kiln {

/// Point `index` of a two-dimensional Owen-scrambled Sobol sequence; every seed gives an independent scrambling.
/// Any first 2^k points are stratified in all elementary intervals.  Both numbers in [0, 1).
/// Cost    80 ns (tests/bench/sphere_rates.cpp, on a busy core)
/// Paper   Burley 2020, "Practical Hash-based Owen Scrambling" (index shuffled, then both dimensions scrambled).
Vec2f sobol_owen(std::uint32_t index, std::uint64_t seed);

/// Area-preserving map of the unit square to the unit disk (Shirley and Chiu 1997).
Vec2<double> disk_from_square(const Vec2<double>& u);

/// Cosine-distributed directions about +z (density cos / pi), and uniform ones on the whole sphere.
Vec3d cosine_hemisphere(const Vec2<double>& u);
Vec3d uniform_sphere(const Vec2<double>& u);

/// Barycentrics (of corners 1 and 2) of a uniform point of a triangle.
Vec2<double> uniform_triangle(const Vec2<double>& u);

inline Vec3f cosine_hemisphere(const Vec2f& u) { return to_float(cosine_hemisphere(Vec2<double>{u.x, u.y})); }

}  // namespace kiln
