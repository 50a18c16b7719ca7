#pragma once
// Both ways in which Kiln reads a scene, and what must hold of whatever they accept.

#include <cmath>
#include <cstring>

#include "core/artifact/import.h"
#include "core/artifact/triangle_stream.h"
#include "core/base/threads.h"
#include "tests/fuzz/target.h"

namespace kiln::fuzz {

/// Small enough that a run over thousands of inputs stays in memory; they are the caller's to choose (import.h).
inline ImportLimits small_limits() {
  ImportLimits limits;
  limits.max_json_bytes = 1u << 20;
  limits.max_objects = 10'000;
  limits.max_image_pixels = 1u << 20;
  limits.max_total_pixels = 4u << 20;
  limits.max_triangles = 1'000'000;
  limits.max_memory_bytes = 256u << 20;
  return limits;
}

inline void check_fault(const Fault& fault) { promise(!fault.code.empty() && !fault.message.empty()); }

inline void check_mesh(const Mesh& mesh) {
  for (const Vec3f& p : mesh.position) promise(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z));
  for (const Vec3f& n : mesh.normal) promise(std::isfinite(n.x) && std::isfinite(n.y) && std::isfinite(n.z));
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t corner : t) promise(corner < mesh.position.size());
}

/// The whole scene in memory, as a bake reads it.
inline void read_whole(const SceneFiles& files) {
  const auto lit = import_lit_scene(files, small_limits());
  if (!lit) return check_fault(lit.error());
  check_mesh(lit->scene.mesh);
}

/// Triangles that pass by, as a reduction reads them. Positions alone: colours and normals go the same way.
inline void read_as_stream(const SceneFiles& files) {
  Findings findings(files.name);
  const TriangleSource source = open_triangles(files, {"/tmp", 256u << 20}, findings);
  if (findings.failed()) return check_fault(findings.fault());
  if (source.triangles > small_limits().max_triangles) return;
  static Threads threads(1);
  const auto done = source.stream(
      Detail::all,
      [](const TriangleBatch& batch) {
        promise(batch.position.size() % 3 == 0);
        for (const Vec3d& p : batch.position) promise(is_sane_position(p));
      },
      threads);
  if (!done) check_fault(done.error());
}

inline SceneFiles as_upload(const std::uint8_t* data, std::size_t size) {
  SceneFiles files;
  files.name = "scene";
  files.main = Bytes(data, data + size);
  return files;
}

}  // namespace kiln::fuzz
