#pragma once
// A bake checks itself: the decoded artefact against the path-traced reference, at random points of its surface.
//
// Points    random on the delivered surface, half of them area-uniform, half where light changes, weighted so that
// every
//           figure is that of area-uniform ones; the reference stands at the nearest place of the input surface with a
//           compatible normal.
// Transport error: lightings of the artefact's own order (constant, six lobes, the job's light, the scene's lamps).
//                  A lighting of which less than a hundredth reaches the surface, or a twentieth of what reaches it of
//                  another (of lamps: a ten-thousandth), in truth and in the artefact, is listed as dark and not
//                  judged: relative to nothing, every rounding is an error.
// Job light The artefact as the job lights it against that light in full detail, lamps and all: what `kiln eval` and
//           `kiln reference` show. It adds what the order cannot hold of a sharp sky.
// Radiosity (order 0) is one light only: the transport error is that of the job's light in full detail.
// Seen      Points inside solids count (the artefact has light to tell there, and truth is black), but nobody sees them
//           (core/prt/hidden.h): the transport error of the others is given besides.
// Spending  spending.h: many points with few paths each, since the interval hangs on a few bad points.
// Never changes the artefact.   Repeat  same numbers for any thread count.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/artifact/baked_scene.h"
#include "core/bake/error_stats.h"
#include "core/base/threads.h"
#include "core/scene/environment.h"
#include "core/trace/tracer.h"

namespace kiln {

struct CertificateOptions {
  std::uint64_t bake_rays = 0;  // what the bake sent: the certificate costs about 5 % of it, or more:
  bool thorough = false;        // about a second where an error target hangs on it, else a tenth of one
  std::uint64_t seed = 0;       // mixed so that it never repeats the bake's own samples
};

struct Certificate {
  ErrorStats transport;
  std::vector<std::string> lightings;   // names, in the order of transport.by_lighting
  std::vector<double> mean_light;       // mean |reference| of each
  std::vector<std::string> dark;        // lightings that hardly reach the surface: not judged
  std::optional<ErrorStats> seen;       // transport at the points that can be seen, when some cannot
  std::optional<ErrorStats> job_light;  // when the job has any
  std::size_t points = 0;               // matched on the input surface
  int samples = 0;                      // paths per point
  double seconds = 0;
};

/// `truth` traces the input's surface; `environment` is the job's own light, if any.
Certificate certify(const BakedScene& decoded, const Tracer& truth, const std::optional<Environment>& environment,
                    const CertificateOptions&, Threads&);

}  // namespace kiln
