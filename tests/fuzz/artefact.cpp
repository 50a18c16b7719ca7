// scene.glb with all of its KILN extensions: what `kiln inspect` and `eval` open, and a bake that carries light along.

#include "core/artifact/baked_scene.h"
#include "core/artifact/carried_scene.h"
#include "core/artifact/lightmap_file.h"
#include "core/artifact/links_glb.h"
#include "core/artifact/points_glb.h"
#include "core/artifact/progressive_glb.h"
#include "tests/fuzz/scene_reading.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kiln;
  const std::span<const std::uint8_t> file{data, size};
  if (const auto carried = import_carried_scene(fuzz::as_upload(data, size), fuzz::small_limits()))
    fuzz::check_mesh(carried->scene.mesh);
  else
    fuzz::check_fault(carried.error());
  if (const auto progressive = read_progressive(file); !progressive) fuzz::check_fault(progressive.error());
  if (const auto points = read_points(file); !points) fuzz::check_fault(points.error());
  if (const auto lightmap = read_lightmap(file); !lightmap) fuzz::check_fault(lightmap.error());
  auto baked = read_baked_glb(file);
  if (!baked) {
    fuzz::check_fault(baked.error());
    return 0;
  }
  fuzz::check_mesh(baked->scene.mesh);
  if (const auto links = read_links(file, *baked); !links) fuzz::check_fault(links.error());
  decode_pixels(baked->scene);
  return 0;
}
