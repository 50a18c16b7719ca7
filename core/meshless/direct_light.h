#pragma once
// Direct light at a point: the scene's lamps, and the sky in full detail.
//   value = irradiance / pi = 1/pi * integral of V(w) L(w) (n.w) dw
// Lamps   flat ones by FlatLamps; where the scene has others, all by Lamps with `many` rays.
// Sky     cosine-distributed rays, and as many again towards the bright parts of a map, joined by the balance heuristic
//         (Veach and Guibas 1995).
// Units   W m^-2 sr^-1.   Repeat  a pure function of its arguments.   Error   unbiased but for FlatLamps

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/base/threads.h"
#include "core/prt/direction_sets.h"
#include "core/prt/flat_lamps.h"
#include "core/prt/transfer_point.h"
#include "core/scene/environment.h"
#include "core/trace/environment_sampler.h"

namespace kiln {

struct DirectRays {
  LampRays lamps;
  int sky = 256;  // cosine rays where there is a sky; as many again where it has brighter parts

  /// A quarter of it: for points whose light is averaged over many.
  DirectRays rough() const {
    const auto quarter = [](int rays) { return rays < 4 ? 1 : rays / 4; };
    return {{quarter(lamps.few), quarter(lamps.many)}, quarter(sky)};
  }
};

class DirectLight {
 public:
  /// Keeps references. `sky` may be null: darkness beyond the scene.
  DirectLight(const Tracer&, const Environment* sky, const DirectRays&);

  bool none() const { return sky_ == nullptr && lamps_.none(); }
  Vec3f at(const Receiver&, std::uint64_t seed, std::uint64_t& rays) const;

 private:
  Vec3f sky_at(const Receiver&, std::uint64_t seed, std::uint64_t& rays) const;

  const Tracer& tracer_;
  Lamps lamps_;
  std::optional<FlatLamps> flat_;
  const Environment* sky_;
  DirectRays budget_;
  DirectionSets sets_;                        // of the sky's cosine rays
  std::optional<EnvironmentSampler> bright_;  // of a map that has brighter and darker parts
};

/// Light at points, each with numbers of its own place. Adds the rays sent to `rays`.
std::vector<Vec3f> light_at(std::span<const TransferPoint>, const DirectLight&, std::uint64_t seed, std::uint64_t& rays,
                            Threads&);

}  // namespace kiln
