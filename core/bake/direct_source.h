#pragma once
// Direct light of both kinds at points, as subdivision sees it: the distant sky's and that of the scene's lamps.
// Columns  lamps ride ahead as four (RGB and nothing: a four of their own in row_store.h), then the sky's bands.
// Scale    so that a squared difference is what the certificate counts (lightings.h): each kind of light in parts of
//          its mean over the surface, each band by the power that light has in it. Unit: mean light =
//          kOpenConstantBand, what an open point has of a constant sky. The paper's measures (eqs. 2-4) see bands as
//          they are.
// Rays     transfer_rays

#include <cstdint>
#include <span>
#include <vector>

#include "core/bake/bake_log.h"
#include "core/bake/plan.h"
#include "core/base/threads.h"
#include "core/prt/direct_transfer.h"
#include "core/prt/interreflection.h"
#include "core/prt/subdivide.h"
#include "core/sphere/sh.h"
#include "core/trace/tracer.h"

namespace kiln {

inline constexpr int kRoughRays = 4;                    // so many times fewer for points that only tell where to split
inline constexpr float kOpenConstantBand = 0.2820948F;  // Y(0,0): t_0 of an unoccluded point

/// About a thousand vertices spread over the mesh: a pilot for what all of them have.
std::vector<TransferPoint> spread_points(const Mesh&);

/// How rays are spent: each point to the noise of the plan, relative to the mean light of about a thousand vertices,
/// that of the sky and that of the lamps each for itself. `band_power` as in lightings.h.
struct TransferRays {
  DirectTransfer sky;
  FixedDirect lamps;
};
TransferRays transfer_rays(const Tracer&, const Plan&, const std::vector<double>& band_power, std::uint64_t seed,
                           Threads&);
/// With a part of the most rays.
TransferRays rough(TransferRays);

class DirectSource {
 public:
  /// Keeps references to tracer, plan, log and threads.
  DirectSource(const Tracer&, const Plan&, const TransferRays&, const std::vector<double>& band_power, BakeLog&,
               Threads&);

  /// Lamp light and the constant band stay within what was sampled: no vertex is darker than black.
  ValueSource source();
  /// Takes the joined columns apart again, and the scale off.
  void separate(const std::vector<float>& joined, std::vector<float>& sky, std::vector<Vec3f>& lamps) const;

  std::uint64_t points() const { return points_; }  // asked for so far
  const TransferStats& stats() const { return stats_; }

 private:
  std::size_t lamp_columns() const { return plan_.lamps ? 4 : 0; }
  std::size_t bands() const { return static_cast<std::size_t>(sh_count(plan_.order)); }
  std::size_t width() const { return lamp_columns() + bands(); }
  std::vector<float> measure_scale(const std::vector<double>& band_power);
  std::vector<float> light(std::span<const TransferPoint>, const DirectTransferBaker&, const FixedDirect&);
  std::vector<float> join(const std::vector<float>& sky, const std::vector<Vec3f>& lamps) const;
  std::uint64_t expected_points() const;

  const Tracer& tracer_;
  const Plan& plan_;
  BakeLog& log_;
  Threads& threads_;
  FixedDirect lamps_, rough_lamps_;
  DirectTransferBaker sky_, rough_sky_;
  TransferStats stats_;
  std::uint64_t points_ = 0;
  std::vector<float> scale_;  // of each column
};

}  // namespace kiln
