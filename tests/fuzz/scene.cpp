// glTF and GLB with their images and compressed geometry.

#include "core/artifact/gltf_container.h"
#include "tests/fuzz/scene_reading.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kiln;
  if (!looks_like_glb({data, size}) && !looks_like_json({data, size})) return 0;  // PLY has a target of its own
  const SceneFiles files = fuzz::as_upload(data, size);
  fuzz::read_whole(files);
  fuzz::read_as_stream(files);
  return 0;
}
