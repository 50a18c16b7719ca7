#pragma once
// Where the meshes and lights of the default scene stand in the world.

#include "core/artifact/affine.h"
#include "core/artifact/gltf_accessor.h"

namespace kiln::gltf {

struct Placement {
  int node = -1, mesh = -1;
  std::vector<Affine> instances;  // one, or those of EXT_mesh_gpu_instancing
};

struct PlacedLight {
  Light light;     // intensity and range in world units
  Vec3d position;  // world
};

struct Placements {
  std::vector<Placement> meshes;
  std::vector<PlacedLight> lights;
};

/// Walks the node forest without recursion, in document order. Predicts the expanded size from counts before it
/// expands instances. Fails with node_too_deep, node_transform_invalid and scene_too_large.
Placements place_nodes(const AccessorSource&, const ImportLimits&, Findings&);

}  // namespace kiln::gltf
