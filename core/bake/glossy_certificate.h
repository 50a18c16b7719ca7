#pragma once
// The certificate of matrices: what the delivered file shows to eyes around it, against the path-traced reference.
//
// Points    random on the surface that has matrices, even by area; each with an eye in a random direction, even over
//           the half space of its normal. The reference stands at the nearest place of the input surface.
// Radiance  all that leaves towards the eye (core/artifact/eye.h): diffuse below the specular layer, and specular
// Specular  the latter alone
// Transport radiance against a truth that shows through the lobe's kernel of the matrices' bands (lobe_table.h) all
// that
//           arrives: noise, interpolation and storage; the faults of the bake
// Truncation of that truth against the real one: what those bands cannot hold of lobes and of what arrives between
//           solids, whatever a bake spends. Radiance is both.
// All under lightings of the matrices' own order, as in certificate.h; `job_light` is radiance under the job's own
// light in full detail, lamps and all: it adds what the order cannot hold of light.
// Truth     the first reflection has the material's GGX lobe, later ones are diffuse as everywhere; the share that the
//           specular layer keeps from the diffuse one is the bake's own formula. Highlights of punctual lights are in
//           neither.
// Never changes the artefact.   Repeat  same numbers for any thread count.

#include <optional>
#include <string>
#include <vector>

#include "core/artifact/baked_scene.h"
#include "core/bake/certificate.h"
#include "core/bake/error_stats.h"

namespace kiln {

struct GlossyCertificate {
  ErrorStats radiance, specular, transport, truncation;
  std::vector<std::string> lightings;   // judged, in the order of radiance.by_lighting
  std::vector<std::string> dark;        // hardly reach the surface: not judged
  std::optional<ErrorStats> job_light;  // when the job has any
  std::size_t points = 0;
  int samples = 0;
  double seconds = 0;
};

/// `decoded` has matrices; the rest as certify().
GlossyCertificate certify_glossy(const BakedScene& decoded, const Tracer& truth,
                                 const std::optional<Environment>& environment, const CertificateOptions&, Threads&);

}  // namespace kiln
