#pragma once
// Principal components of transfer vectors (Sloan et al. 2003, one cluster): over a whole scene they are a mean and few
// numbers that vary.
//   t[s](v) ~ mean[s] + sum_k w_k(v) c_k[s],   w_k(v) = sum_s d_k[s] (t[s](v) - mean[s])                         (1)
// Metric    an error of t counts as the error of light that it causes, as relRMSE (mean over vertices by area, and over
//           R, G, B) under light of a given power in each band and no preferred direction: slots of one band count the
//           same, and no environment that users may turn or drop in is favoured. In this metric the c_k are
//           orthonormal: rounding w_k by d adds d^2 / 12 to the squared relRMSE. A surface that a hundredth of the sky
//           reaches at most is judged as if a hundredth did.
// Light of the scene's own lamps is no part of it: rows are zero there.
// Repeat    same numbers for same input.   Cost   vertices x slots^2 multiply-adds.

#include <cstddef>
#include <span>
#include <vector>

#include "core/mesh/mesh.h"
#include "core/prt/transfer.h"

namespace kiln {

/// Equation 1's mean and c_k: all that a reader needs.
struct Components {
  std::size_t stride = 0;   // as Transfer::stride()
  std::vector<float> rows;  // (rank + 1) x stride: the mean, then c_0 ..

  std::size_t rank() const { return stride == 0 ? 0 : rows.size() / stride - 1; }
  const float* mean() const { return rows.data(); }
  const float* row(std::size_t k) const { return rows.data() + (k + 1) * stride; }
};

struct ComponentAnalysis {
  Components components;         // all of them, by falling share
  std::vector<double> left_out;  // [r]: relRMSE that the first r leave, r = 0 .. rank
  std::vector<double> duals;     // rank x stride: d_k of equation 1

  /// The first `rank` components.
  Components first(std::size_t rank) const;
  /// w_0 .. w_{rank-1} of every vertex.
  std::vector<float> weights(const Transfer&, std::size_t rank) const;
};

/// `band_power[l]`: mean squared coefficient in band l of light whose mean over all directions is 1; all above zero.
ComponentAnalysis analyse_components(const Transfer&, const Mesh&, std::span<const double> band_power);

}  // namespace kiln
