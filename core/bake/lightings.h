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

/// Of the artefact's own order and light. A lobe is max(0, w . axis)^4: positive light that no two axes share much of.
Lightings test_lightings(int order, const BakedLight&);

/// Power of the lightings in each band: the mean squared coefficient of light scaled to a mean of 1 over all
/// directions, had they no preferred direction. Besides the test lightings and the job's own a sun counts, whose bands
/// are all alike.
std::vector<double> band_power(int order, const BakedLight&);

}  // namespace kiln
