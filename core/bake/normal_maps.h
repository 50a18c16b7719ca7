#pragma once
// Normal maps, which no bake sees: what a light field leaves out by them.
//   degrees = root mean square over the surface that has one of the angle between (0, 0, 1) and the texel,
//             (2 r - 1, 2 g - 1) scale, 2 b - 1                                                                     (1)
// Source  glTF 2.0, normalTextureInfo.   Error  4096 points.   Repeat  a pure function of the scene

#include <cstddef>
#include <optional>
#include <vector>

#include "core/scene/scene.h"

namespace kiln {

struct NormalMaps {
  std::vector<std::size_t> materials;  // that have one, of parts that have triangles
  double degrees = 0;                  // 0 where no image can be read
};

/// Nothing where no part has one. Decodes the images.
std::optional<NormalMaps> find_normal_maps(const Scene&);

}  // namespace kiln
