#pragma once
// Direct diffuse transfer: the light a white point re-emits, as a linear map of distant SH light.
//   t_i = 1/pi * integral over the sphere of V(w) max(n.w, 0) Y_i(w) dw                                    (1)
// Paper   [Krivanek04] section 2; conventions of core/sphere/sh.h.
// Shape   out[v * sh_count(order) + i]
// Units   dot(t, L) is exit radiance at albedo 1 for SH radiance L (W m^-2 sr^-1)
// Repeat  same bits for any thread count.      Fails  never on a valid Scene; Cancelled if stopped

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/base/threads.h"
#include "core/prt/transfer_point.h"
#include "core/trace/tracer.h"

namespace kiln {

// Rays     rounds of 64, 64, 128, ... up to `samples`. A point stops after the round whose estimate differs so little
//          from that of the rounds before that its own error is likely below `tolerance`:
//            error(n)^2 ~ 0.7 sum_i p_l(i) (t_i(n) - t_i(n/2))^2
//          as halves of a stratified set differ by errors of their own size, which fall as n^-3/4 at shadow edges.

struct DirectTransfer {
  int order = 6;       // bands, 1..kMaxShOrder; coefficients = order^2
  int samples = 1024;  // most rays per point, 1..65536; rounded up to a multiple of 16
  std::uint64_t seed = 0;
  float tolerance = 0;                 // of the light of a point, 1 in the open under light of mean 1; 0: all rays
  std::vector<float> band_power = {};  // p_l: mean squared coefficient of such light in band l; order of them
};

struct TransferStats {
  std::uint64_t rays = 0;
  std::uint64_t open_points = 0;  // points that took the closed form without a ray
};

/// For many calls on one scene: keeps the direction sets and the test for open points.
class DirectTransferBaker {
 public:
  /// Keeps a reference to the tracer, which must outlive it.
  DirectTransferBaker(const Tracer&, const DirectTransfer&);
  ~DirectTransferBaker();
  std::vector<float> bake(std::span<const TransferPoint>, Threads&, TransferStats* stats = nullptr) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

std::vector<float> bake_direct_transfer(const Tracer&, std::span<const TransferPoint>, const DirectTransfer&, Threads&,
                                        TransferStats* stats = nullptr);

}  // namespace kiln
