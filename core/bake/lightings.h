#pragma once
// The lightings under which a relightable result is judged: a constant sky, six lobes along the axes, the job's own
// light.

#include <string>
#include <vector>

#include "core/artifact/baked_scene.h"
#include "core/base/vec.h"

namespace kiln {

struct Lightings {
  std::vector<std::string> names;
  std::vector<std::vector<Vec3f>> sh;  // sh_count(order) RGB each
};

/// Of the artefact's own order. A lobe is max(0, w . axis)^4: positive light that no two axes share much of.
Lightings test_lightings(const BakedScene&);

}  // namespace kiln
