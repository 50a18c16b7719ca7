#pragma once
// What a bake will model and what it leaves out, decided from cheap measurements, each with its reason.

#include <cstdint>
#include <string>
#include <vector>

#include "core/bake/recipe.h"
#include "core/base/threads.h"
#include "core/prt/subdivide.h"
#include "core/scene/environment.h"
#include "core/scene/scene.h"

namespace kiln {

struct Decision {
  std::string decision;  // "order", "bounces", ...
  std::string value;     // "6"
  std::string reason;
};

/// Numbers known before any ray is traced. `vertices` is what the memory bound is taken from: a worst case.
struct Prediction {
  std::uint64_t triangles = 0, vertices = 0;
  std::uint64_t memory_bytes = 0;
  std::uint64_t rays = 0;
  double seconds = 0;
  std::uint64_t artifact_bytes = 0;
};

struct Plan {
  int order = 6;
  int bounces = 0;
  int samples = 1024;        // rays per point for distant light
  int bounce_samples = 256;  // rays per vertex and bounce
  int lamp_samples = 64;     // shadow rays per point over all emitters
  bool lamps = false;        // the scene has light of its own
  bool split = false;        // subdivide at all
  Subdivide subdivide;
  int coefficient_bits = 12;
  std::vector<Decision> decisions;
  Prediction prediction;
};

/// Traces a few thousand paths to see how many reflections matter, unless the step says.
Plan make_plan(const Scene&, const PrtStep&, Quality, Threads&);

}  // namespace kiln
