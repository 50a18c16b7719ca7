#pragma once
// A lightmap checks itself: light at random points of the delivered surface, filtered from the decoded files, against
// the path-traced reference of the same light.
//
// Points   area-uniform on the parts that the lightmap shows, each matched with the nearest place of the true surface;
//          those inside solids, which nobody sees, are left out
// Repeat   same numbers for any thread count.   Never changes the lightmap

#include <cstdint>

#include "core/artifact/baked_scene.h"
#include "core/bake/error_stats.h"
#include "core/base/threads.h"
#include "core/scene/environment.h"
#include "core/trace/tracer.h"

namespace kiln {

struct LightmapCertificate {
  ErrorStats error, image;  // of lightmap.exr; of the image in scene.glb
  double mean_light = 0;    // of the reference, value = irradiance / pi
  bool dark = false;        // lit by nothing: error 0 by definition
  std::size_t points = 0;   // that can be seen
  int samples = 0;          // paths a point
  std::uint64_t rays = 0;   // of the reference
  double seconds = 0;
};

struct LightmapCheck {
  const BakedScene& decoded;         // geometry and coordinates
  const Lightmap &lightmap, &image;  // parts are those of `decoded`
  const Tracer& truth;
  const Environment* sky = nullptr;
  int bounces = -1;  // as baked; -1: all
  std::uint64_t bake_rays = 0, seed = 0;
};

LightmapCertificate certify_lightmap(const LightmapCheck&, Threads&);

}  // namespace kiln
