#pragma once
// Components of transfer matrices: a mean and few rows that all matrices of a scene are sums of.
// From    the matrices of some points spread evenly over the surface: principal ones, by their Gram matrix
// Metric  an error of M counts as that of the arriving light that it causes, relative to the mean light that arrives,
//         in the mean over directions, R, G, B and area, under distant light of the given power in each band and no
//         preferred direction; lamps count as one more lighting, relative to their own mean light.
//         (core/prt/components.h is the same for transfer vectors.) Bands that a rough surface blurs away count as if a
//         mirror showed them.
// Repeat  a pure function of its arguments

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "core/prt/glossy_transfer.h"

namespace kiln {

struct GlossyRank {
  std::vector<double> band_power = {};  // of light of mean 1: order of them, all above zero
  double left_out = 0.01;               // relative error of the arriving light that components may leave
  std::size_t most = 128;               // components
};

class GlossyComponents {
 public:
  /// `shape` has no components yet. `matrices` are one or more, each of shape.stride() numbers.
  GlossyComponents(const GlossyTransfer& shape, std::span<const float> matrices, const GlossyRank&);
  ~GlossyComponents();

  std::size_t rank() const;
  Components components() const;
  /// Weights of matrices, rank() each, and for each the square of what the components leave out of it.
  void project(std::span<const float> matrices, float* weights, double* left) const;
  /// Relative error of the arriving light from the rays of one draw, by two draws of the same matrices.
  double noise(std::span<const float> a, std::span<const float> b) const;
  /// The largest sum of |numbers| down a column (the 1-norm) of the matrix that a difference of weights makes, in parts
  /// of the mean light that arrives: how much light of one harmonic it moves to or from all harmonics.
  float norm1(std::span<const float> weights) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kiln
