// PLY, ASCII and binary.

#include "core/artifact/ply_scene.h"
#include "tests/fuzz/scene_reading.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kiln;
  if (!looks_like_ply({data, size})) return 0;
  const SceneFiles files = fuzz::as_upload(data, size);
  fuzz::read_whole(files);
  fuzz::read_as_stream(files);
  return 0;
}
