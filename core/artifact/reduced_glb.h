#pragma once
// A reduced model as a plain glTF: no extension, one mesh, textures inside. Any viewer shows it.

#include <string>

#include "core/artifact/import.h"
#include "core/reduce/surface_maps.h"

namespace kiln {

struct ReducedGlb {
  const Mesh& mesh;         // unit cube; uv0 and tangents where there are maps
  const SurfaceMaps& maps;  // side 0: none; colours are then the vertices'
  UnitFrame frame;          // becomes the node's translation and scale
  std::string name;         // of node and mesh
  std::string provenance;   // a JSON object for asset.extras.kiln
};

/// The bytes of a GLB: float32 attributes, a buffer view each; PNG textures of 8 bits.
/// Fails with result_too_large.
Result<Bytes> write_reduced_glb(const ReducedGlb&);

}  // namespace kiln
