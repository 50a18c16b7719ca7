#pragma once
// A bake checks itself: the decoded artefact against the path-traced reference, at random points of its surface.
//
// Points    area-uniform on the delivered surface; the reference stands at the nearest place of the input surface with
//           a compatible normal.
// Transport error: lightings of the artefact's own order (constant, six lobes, the job's light, the scene's lamps).
//                  A lighting of which less than a hundredth reaches the surface, in truth and in the artefact, is
//                  listed as dark and not judged: relative to nothing, every rounding is an error.
// Truncation: the job's environment in full detail against the artefact under its projection, reported apart.
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
  std::size_t points = 1024;
  std::uint64_t bake_rays = 0;  // what the bake sent: paths cost about 5 % of it, or about a second
  std::uint64_t seed = 0;       // mixed so that it never repeats the bake's own samples
};

struct Certificate {
  ErrorStats transport;
  std::vector<std::string> lightings;    // names, in the order of transport.by_lighting
  std::vector<std::string> dark;         // lightings that hardly reach the surface: not judged
  std::optional<ErrorStats> truncation;  // of the job's environment, when it is a map or a formula
  std::size_t points = 0;                // matched on the input surface
  int samples = 0;                       // paths per point, from 256 to 4096
  double seconds = 0;
};

/// `truth` traces the input's surface; `environment` is the job's own light, if any.
Certificate certify(const BakedScene& decoded, const Tracer& truth, const std::optional<Environment>& environment,
                    const CertificateOptions&, Threads&);

}  // namespace kiln
