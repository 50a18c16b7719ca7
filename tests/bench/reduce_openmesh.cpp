#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalFlippingT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>

#include "tests/bench/reduce_rivals.h"

namespace kiln::bench {

void simplify_openmesh(Surface& surface, std::size_t triangles) {
  using Traits = OpenMesh::DefaultTraits;
  using TriMesh = OpenMesh::TriMesh_ArrayKernelT<Traits>;
  TriMesh mesh;
  std::vector<TriMesh::VertexHandle> handles;
  for (const Vec3d& p : surface.position)
    handles.push_back(mesh.add_vertex({static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)}));
  for (const Triangle& t : surface.triangles) mesh.add_face(handles[t[0]], handles[t[1]], handles[t[2]]);
  mesh.request_face_normals();
  mesh.update_face_normals();
  OpenMesh::Decimater::DecimaterT<TriMesh> decimater(mesh);
  OpenMesh::Decimater::ModQuadricT<TriMesh>::Handle quadric;
  OpenMesh::Decimater::ModNormalFlippingT<TriMesh>::Handle flipping;
  decimater.add(quadric);
  decimater.module(quadric).unset_max_err();
  decimater.add(flipping);
  decimater.initialize();
  decimater.decimate_to_faces(0, triangles);
  mesh.garbage_collection();
  surface = {};
  for (const auto v : mesh.vertices()) {
    const auto& p = mesh.point(v);
    surface.position.push_back({p[0], p[1], p[2]});
  }
  surface.sample.resize(surface.position.size());
  for (const auto f : mesh.faces()) {
    Triangle t;
    std::size_t i = 0;
    for (auto v = mesh.cfv_iter(f); v.is_valid() && i < 3; ++v) t[i++] = static_cast<std::uint32_t>(v->idx());
    surface.triangles.push_back(t);
  }
}

}  // namespace kiln::bench
