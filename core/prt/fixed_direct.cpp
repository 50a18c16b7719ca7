#include <algorithm>
#include <optional>

#include "core/base/expects.h"
#include "core/base/random.h"
#include "core/base/shared_loop.h"
#include "core/prt/flat_lamps.h"
#include "core/prt/interreflection.h"
#include "core/prt/lamps.h"
#include "core/prt/ray_origin.h"

namespace kiln {
namespace {

/// A quarter of the rays tells whether a lamp is partly hidden, but no fewer than tell at all.
LampRays lamp_rays(const FixedDirect& params, std::size_t lamps) {
  const int each = std::max(1, params.samples / static_cast<int>(lamps));
  const int few = std::max(32, each / 4);
  return {few, std::max(few, each * params.reach), params.tolerance};
}

}  // namespace

std::vector<Vec3f> bake_fixed_direct(const Tracer& tracer, std::span<const TransferPoint> points,
                                     const FixedDirect& params, Threads& threads, TransferStats* stats) {
  EXPECTS(params.samples >= 1 && params.samples * params.reach <= SobolPoints::kMost);
  std::vector<Vec3f> out(points.size());
  const Lamps lamps(tracer);
  if (lamps.none()) return out;
  const std::optional<FlatLamps> flat = FlatLamps::find(tracer);
  const EmitterRays anyhow{params.samples, params.reach, params.tolerance};
  const LampRays of_each = flat ? lamp_rays(params, flat->count()) : LampRays{};
  constexpr std::size_t kBlock = 64;
  const std::vector<std::uint32_t> order = morton_order_of(points);
  BlockCounts rays(points.size(), kBlock);
  run_loop({.name = "light of lamps",
            .items = points.size(),
            .block = kBlock,
            .body =
                [&](std::size_t begin, std::size_t end) {
                  std::uint64_t sent = (end - begin) * tracer.scene().lights.size();
                  for (std::size_t i = begin; i < end; ++i) {
                    const TransferPoint& p = points[order[i]];
                    const Receiver receiver{ray_origin(p), p.normal};
                    const std::uint64_t seed = mix64(params.seed ^ point_key(p));
                    out[order[i]] = lamps.punctual(receiver) + (flat ? flat->light_at(receiver, of_each, seed, sent)
                                                                     : lamps.emitted(receiver, anyhow, seed, sent));
                  }
                  rays.at(begin) = sent;
                },
            .pass =
                [&](std::size_t begin, std::size_t end, ItemStream& stream) {
                  for (std::size_t i = begin; i < end; ++i) stream.pass(out[order[i]]);
                  rays.pass(begin, end, stream);
                }},
           threads);
  if (stats != nullptr) stats->rays += rays.sum();
  return out;
}

}  // namespace kiln
