#pragma once
// How a bake's transfer vectors are stored: raw, or as weights of as few components and in as few bits as the share of
// the error allows that the plan leaves to storage. Half of its square goes to components left out, half to rounding.

#include <span>

#include "core/artifact/baked_scene.h"
#include "core/bake/plan.h"
#include "core/bake/transport.h"

namespace kiln {

struct Compression {
  TransferEncoding encoding;
  double left_out = 0;  // relRMSE of the components that are not stored, by band_power (lightings.h)
};

Compression choose_encoding(const BakedScene&, const Plan&);

/// What storage changes at some vertices.
struct StorageProbes {
  Probes left_out;  // by components that are not stored
  Probes rounding;
};

StorageProbes probe_storage(const BakedScene&, const TransferEncoding&, std::span<const std::uint32_t> vertices);

}  // namespace kiln
