#pragma once
// Surface that nobody can see: a floor under a column, a leg inside a table top.
//
// A vertex in there is black, and right about itself. But the triangle that joins it to a vertex outside is half seen,
// and interpolation would carry the black out from under the column: dark teeth along every contact line. So a hidden
// vertex beside a seen one stands in for the last place on their edge that can be seen.
// Hidden  the first thing in every one of 64 directions over the point is the back of a single-sided face: the inside
// of
//         a solid. (The inside of double-sided faces is a room as well as a solid.)
// Repeat  same results for any thread count

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/base/threads.h"
#include "core/mesh/mesh.h"
#include "core/mesh/part_vertices.h"
#include "core/prt/transfer_point.h"
#include "core/trace/tracer.h"

namespace kiln {

using HiddenTest = std::function<bool(const TransferPoint&)>;

/// Keeps a reference to the tracer.
HiddenTest hidden_test(const Tracer&);

/// What those directions meet: something else too, only backs, or only backs of single-sided faces. Among the backs of
/// double-sided faces (against their vertex normals) a place is inside a solid where it has hardly any light either:
/// rooms show their fronts to those inside.
inline constexpr double kDarkInside = 1e-3;  // of the mean light
enum class Enclosure : std::uint8_t { open, backs, solid };
std::function<Enclosure(const TransferPoint&)> enclosure_test(const Tracer&);

/// Where the light of a vertex is taken instead.
struct StandIn {
  std::uint32_t vertex = 0;
  TransferPoint point;
};

/// A stand-in for each hidden vertex that shares an edge with one that is not: of several such edges the place nearest
/// to the vertex counts. Vertices ascend. `dark` has a flag for each vertex without any light, or is empty. On a
/// contact line the sample of a vertex may have leant to the hidden side and the vertex itself (vertex_points) not:
/// then it stands in for itself.
std::vector<StandIn> find_stand_ins(const Mesh&, const std::vector<bool>& dark, const HiddenTest&, Threads&);

/// Where vertices are lit: in their own places, or in those of their stand-ins (ascending).
std::vector<TransferPoint> lit_places(const Mesh&, std::span<const std::uint32_t> vertices, std::span<const StandIn>);

/// Which of some edges (ascending) have a middle that is hidden on one of their faces.
std::vector<bool> hidden_middles(const Mesh&, const std::vector<MeshEdge>&, const HiddenTest&, Threads&);

}  // namespace kiln
