#pragma once
// Cuts where another surface pierces the mesh: the foot of a column on a floor, a beam in a wall.
//
// Light jumps there, and a triangle across the line carries the light of one side to the other however small it is. So
// an edge that is pierced is cut where that happens, and what is left of the triangles on either side of the line gets
// vertices of its own there: light is continuous on each side. (Discontinuity meshing, Heckbert 1992, for contact
// lines only.)
// Crack-free  an edge is cut for all triangles that share it by position.   Cost  two rays an edge
// Bounded     never more triangles than the budget: edges along which light changes most, times their length, are cut
//             first.   Repeat  any thread count

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "core/base/threads.h"
#include "core/prt/hidden.h"
#include "core/prt/split_mesh.h"
#include "core/prt/transfer_point.h"
#include "core/trace/tracer.h"

namespace kiln {

/// Where the way from a to b, a hair above the surface, is stopped: seen from a and seen from b, as shares of it.
struct Pierced {
  float from_a = 0, from_b = 1;
};

/// Nothing where the way is free, or is stopped only within a 64th of its ends.
using PierceTest = std::function<std::optional<Pierced>(const TransferPoint& a, const TransferPoint& b)>;

/// Keeps a reference to the tracer.
PierceTest pierce_test(const Tracer&);

/// How a triangle is pierced.
struct PiercedTriangle {
  std::uint8_t edges = 0;  // about as many more triangles will there be
  bool straight = false;   // the cut will follow the line: it is straight between two edges
};

PiercedTriangle pierced_triangle(const Mesh&, const Triangle&, const PierceTest&);

/// How much the light of two vertices differs.
using LightContrast = std::function<float(std::uint32_t a, std::uint32_t b)>;

/// Cuts the pierced edges of `closed` and returns the new vertices with the points whose light they have. The values of
/// new vertices (closed.point) are the caller's to find.
std::vector<StandIn> cut_pierced(ClosedMesh& closed, const PierceTest&, const LightContrast&, std::uint64_t budget,
                                 Threads&);

}  // namespace kiln
