#pragma once
// Links check themselves: reflected light of lamps at random points of the surface, read from the decoded file as a
// viewer shows it (interpolated between vertices), against the path-traced reference of the same lamps.
//
// Lamps    kCertifiedLamps of 1 W/sr in random free places (core/meshless/free_places.h), other ones than those the
// bake
//          refined for, and the scene's own point lights, at most as many. Each is one lighting. Own ones that touch
//          what is around them are left out: what a point light reflects has no bound there. Where a promise hangs on
//          it, twice as many.
// Points   random on the delivered surface, half of them area-uniform, half where the lamps' reflected light is (a lamp
//          lights one room of many), weighted so that every figure is that of area-uniform ones; the reference stands
//          at the nearest place of the input with a compatible normal. Those inside solids, which nobody sees, are left
//          out.
// Repeat   same numbers for any thread count.   Never changes the artefact

#include <cstdint>

#include "core/artifact/baked_scene.h"
#include "core/bake/error_stats.h"
#include "core/meshless/link_builder.h"

namespace kiln {

inline constexpr std::size_t kCertifiedLamps = 8;

/// Where the error relative to the root mean square comes from; the squares sum to its own, unless they exceed it.
struct LinkSources {
  double noise = 0, links = 0;  // of rows, as LinkErrors
  double interpolation = 0;     // between vertices: what reading the links at the points themselves does not have
  double senders = 0;  // what is left: their cells, which a spot of light near a lamp does not fill, and sweeps
};

struct LinksCertificate {
  ErrorStats error;
  // Relative to the root mean square of each lamp's light; a lamp that lights a hundredth of a scene has ten times this
  // relative to the mean. A promise bounds it, so that its interval allows for other lamps too.
  ErrorStats of_rms;
  LinkSources sources;
  std::vector<Vec3d> lamps;        // world places
  std::vector<double> mean_light;  // of the reference under each: value = irradiance / pi
  bool dark = false;               // nothing is reflected: error 0 by definition
  std::size_t points = 0;
  int samples = 0;         // paths a point
  std::uint64_t rays = 0;  // of the reference
  double seconds = 0;
};

struct LinksCheck {
  const BakedScene& decoded;
  const LightLinks& links;     // decoded
  const LinkBuilder* builder;  // null: the sources are not asked for
  const Tracer& truth;         // the input's surface
  int bounces = -1;            // as baked; -1: all
  std::uint64_t bake_rays = 0;
  bool thorough = false;  // an error target hangs on it
  std::uint64_t seed = 0;
};

LinksCertificate certify_links(const LinksCheck&, Threads&);

}  // namespace kiln
