#pragma once
// Links check themselves: reflected light of lamps at random points of the surface, read from the decoded file as a
// viewer shows it (interpolated between vertices), against the path-traced reference of the same lamps.
//
// Lamps    kCertifiedLamps of 1 W/sr in random free places (core/meshless/free_places.h), other ones than those the
// bake
//          refined for, and the scene's own point lights, at most as many. Each is one lighting. Own ones that touch
//          what is around them are left out: what a point light reflects has no bound there.
// Points   random on the delivered surface, half of them area-uniform, half where the lamps' reflected light is (a lamp
//          lights one room of many), weighted so that every figure is that of area-uniform ones; the reference stands
//          at the nearest place of the input with a compatible normal. Those inside solids, which nobody sees, are left
//          out.
// Repeat   same numbers for any thread count.   Never changes the artefact

#include <cstdint>

#include "core/artifact/baked_scene.h"
#include "core/bake/error_stats.h"
#include "core/meshless/light_links.h"

namespace kiln {

inline constexpr std::size_t kCertifiedLamps = 8;

struct LinksCertificate {
  ErrorStats error;
  std::vector<Vec3d> lamps;        // world places
  std::vector<double> mean_light;  // of the reference under each: value = irradiance / pi
  double of_rms = 0;  // root of the squared error over the squared light, less the noise of both: where a lamp lights a
                      // hundredth of a scene its relRMSE is ten times this
  bool dark = false;  // nothing is reflected: error 0 by definition
  std::size_t points = 0;
  int samples = 0;         // paths a point
  std::uint64_t rays = 0;  // of the reference
  double seconds = 0;
};

struct LinksCheck {
  const BakedScene& decoded;
  const LightLinks& links;  // decoded
  const Tracer& truth;      // the input's surface
  int bounces = -1;         // as baked; -1: all
  std::uint64_t bake_rays = 0;
  bool thorough = false;  // a promise hangs on it
  std::uint64_t seed = 0;
};

LinksCertificate certify_links(const LinksCheck&, Threads&);

}  // namespace kiln
