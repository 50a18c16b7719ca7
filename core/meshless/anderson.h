#pragma once
// Fewer sweeps of x = g(x) for a linear g that shrinks distances: Anderson mixing.
//   f_k = g(x_k) - x_k,   x_{k+1} = g(x_k) - sum_j gamma_j (g_{j+1} - g_j),
//   gamma the least squares solution of   f_k ~ sum_j gamma_j (f_{j+1} - f_j)                                  (1)
// over the last kDepth steps. Light between two sheets that reflect nearly all takes hundreds of plain sweeps.
// Paper   Walker and Ni 2011 (Anderson 1965); for linear g as good as GMRES(kDepth).
// Repeat  a pure function of what it was given, in order

#include <cstddef>
#include <vector>

#include "core/base/vec.h"

namespace kiln {

class AndersonMixing {
 public:
  static constexpr std::size_t kDepth = 8;

  /// The next x from the last one and g of it, which are as many numbers each time.
  std::vector<Vec3f> next(const std::vector<Vec3f>& x, const std::vector<Vec3f>& g);

 private:
  std::vector<Vec3f> last_f_, last_g_;
  std::vector<std::vector<Vec3f>> df_, dg_;  // the oldest first
};

}  // namespace kiln
