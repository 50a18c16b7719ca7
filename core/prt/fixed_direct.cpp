#include "core/base/expects.h"
#include "core/base/random.h"
#include "core/base/shared_loop.h"
#include "core/prt/interreflection.h"
#include "core/prt/lamps.h"
#include "core/prt/ray_origin.h"

namespace kiln {

std::vector<Vec3f> bake_fixed_direct(const Tracer& tracer, std::span<const TransferPoint> points,
                                     const FixedDirect& params, Threads& threads, TransferStats* stats) {
  EXPECTS(params.samples >= 1 && params.samples * params.reach <= 65536);
  std::vector<Vec3f> out(points.size());
  const Lamps lamps(tracer);
  if (lamps.none()) return out;
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
                    out[order[i]] =
                        lamps.punctual(receiver) +
                        lamps.emitted(receiver, {params.samples, params.reach, params.tolerance}, seed, sent);
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
