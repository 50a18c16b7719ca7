#pragma once
// Where the error of a bake comes from, in the unit of its certificate: relRMSE under the lightings that were judged.
//
//   noise          of the rays, from two independent draws at a few hundred vertices; interpolation halves its
//   variance;
//                  noise_of_reflections is the part of it that the rays between surfaces have
//   bounce_tail    share of the light in reflections beyond the last, from the plan's sample paths
//   merging        vertices that the input had and the result has not, as estimated when they went (merge_step.h)
//   points         reflected light that vertices read of points around them (core/meshless), beside what they would
//   gather
//                  for themselves
//   quantisation   rounding of the stored numbers, compression   components that are not stored: what a reader finds at
//                  the same vertices
//   interpolation  what of the measured error the others leave: light that changes within triangles
//   truncation     what the order cannot hold of the job's own light; beside the transport error, not part of it
// These (but for truncation, and the part of the noise) are squares that sum to the certificate's relRMSE, unless the
// estimates alone exceed it.

#include <optional>

#include "core/artifact/baked_scene.h"
#include "core/bake/certificate.h"
#include "core/bake/compression.h"
#include "core/bake/plan.h"
#include "core/bake/transport.h"

namespace kiln {

struct ErrorSources {
  double noise = 0, noise_of_reflections = 0, bounce_tail = 0, quantisation = 0, compression = 0, interpolation = 0;
  double merging = 0, points = 0;
  std::optional<double> truncation;
};

/// What the bake knows beside the certificate.
struct KnownErrors {
  const NoiseProbes& noise;
  const StorageProbes& storage;
  double tail_left = 0, merging = 0;
  double points_squared = 0;  // of the light that vertices read of points: mean over vertices and channels
};

ErrorSources split_error(const Certificate&, const BakedScene& decoded, const KnownErrors&);

}  // namespace kiln
