#pragma once
// A mesh with a surface light field at its vertices, and what is done alike to every attribute of them.

#include <cstdint>
#include <vector>

#include "core/lightfield/light_field.h"
#include "core/mesh/mesh.h"

namespace kiln {

/// field.vertices() is mesh.position.size().
struct LitMesh {
  Mesh mesh;
  LightField field;
};

/// Calls visit(array) for every attribute that the mesh has, the position first.
template <class AnyMesh, class Visit>
void each_attribute(AnyMesh& mesh, const Visit& visit) {
  visit(mesh.position);
  visit(mesh.normal);
  if (!mesh.uv0.empty()) visit(mesh.uv0);
  if (!mesh.uv1.empty()) visit(mesh.uv1);
  if (!mesh.color.empty()) visit(mesh.color);
  if (!mesh.tangent.empty()) visit(mesh.tangent);
}

/// Calls visit(array of a, array of b) for every attribute that `b` has.
template <class MeshA, class MeshB, class Visit>
void each_attribute_of(MeshA& a, MeshB& b, const Visit& visit) {
  visit(a.position, b.position);
  visit(a.normal, b.normal);
  if (!b.uv0.empty()) visit(a.uv0, b.uv0);
  if (!b.uv1.empty()) visit(a.uv1, b.uv1);
  if (!b.color.empty()) visit(a.color, b.color);
  if (!b.tangent.empty()) visit(a.tangent, b.tangent);
}

/// Appends a copy of a vertex of `from` to `to`, which has the same attributes, or no vertices yet. Returns its index.
std::uint32_t append_vertex(LitMesh& to, const LitMesh& from, std::uint32_t vertex);

/// Vertex `to` becomes the mix (1 - share) of `from` and share of itself; normal and tangent stay unit.
void draw_towards(LitMesh&, std::uint32_t to, std::uint32_t from, float share);

/// Leaves only the vertices that triangles use, in their order.
void drop_unused_vertices(LitMesh&);

}  // namespace kiln
