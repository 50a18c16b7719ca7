#pragma once
// Where transfer is wanted: a vertex, or an edge midpoint that may become one.

#include <cstdint>
#include <vector>

#include "core/mesh/mesh.h"

namespace kiln {

struct TransferPoint {
  Vec3f position;  // unit-cube coordinates
  Vec3f normal;    // unit shading normal
  Vec3f inward;    // a point on an adjacent face towards which the ray origin is pulled by a hair, so that a vertex
                   // on a wall does not look through it (vertex_points fills it)
  Vec3f face_normal;
};

inline constexpr std::uint32_t kNoFace = 0xffffffffU;

/// For each vertex its adjacent triangle with the widest angle there (the first of equals; degenerate ones never), or
/// kNoFace. The widest angle has the most surface near the vertex and keeps the pulled origin clear of other walls.
std::vector<std::uint32_t> widest_faces(const Mesh&);

/// The point of one vertex, leaning into `face` along the bisector of its angle there (kNoFace: along its own normal
/// only).
TransferPoint vertex_point(const Mesh&, std::uint32_t vertex, std::uint32_t face);

/// A point at `share` of the way from vertex a to vertex b, which lie on one side of `face`: it leans into the face,
/// straight away from that side.
TransferPoint edge_point(const Mesh&, const Triangle& face, std::uint32_t a, std::uint32_t b, float share);

/// A point for each vertex of the mesh.
std::vector<TransferPoint> vertex_points(const Mesh&);

}  // namespace kiln
