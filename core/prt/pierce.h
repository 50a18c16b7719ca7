#pragma once
// Where another surface pierces the mesh: the foot of a column on a floor, a beam in a wall. Light jumps there.
//
// Seen from a hair above the surface: a ray from one point of it to another meets what stands between them.
// Cost  three rays where something stands, else one

#include <cstdint>
#include <functional>
#include <optional>

#include "core/mesh/mesh.h"
#include "core/prt/transfer_point.h"
#include "core/trace/tracer.h"

namespace kiln {

inline constexpr float kClear = 3e-5F;  // unit cube: from there rays neither meet the surface nor what pierces it

/// Where the way from a to b is stopped: seen from a and seen from b, as shares of it.
struct Pierced {
  float from_a = 0, from_b = 1;
  float middle() const { return 0.5F * (from_a + from_b); }
};

/// Nothing where the way is free, or where what stops it stands less than 1e-4 high: tiles that overlap in one plane
/// are within rounding of each other.
using PierceTest = std::function<std::optional<Pierced>(const TransferPoint& a, const TransferPoint& b)>;

/// Keeps a reference to the tracer.
PierceTest pierce_test(const Tracer&);

/// A point at `share` of the way from vertex a to vertex b that leans into `triangle`.
TransferPoint between(const Mesh&, const Triangle& triangle, std::uint32_t a, std::uint32_t b, float share);

/// Where an edge of a triangle can be cut. Nothing nearer to its ends than a 64th of it; nor where the way between the
/// two places is longer than an eighth: there is light of its own in there.
std::optional<Pierced> cut_of_edge(const Mesh&, const Triangle&, std::uint32_t a, std::uint32_t b, const PierceTest&);

/// How a triangle is pierced.
struct PiercedTriangle {
  std::uint8_t cuts = 0;  // edges that can be cut: about as many more triangles will there be
  bool straight = false;  // the cut will follow the line: it is straight between two edges
};

PiercedTriangle pierced_triangle(const Mesh&, const Triangle&, const PierceTest&);

}  // namespace kiln
