#pragma once
// Per-vertex light transport: the result type that every later stage reads.

#include <cstddef>
#include <vector>

#include "core/sphere/sh.h"

namespace kiln {

/// A linear map from lighting to the radiance that leaves a white point, for each vertex:
///   value[c](v) = sum_i at(v, c)[i] * L_i[c]  (+ at(v, c)[sh_count(order)] where `fixed`: light of the scene's own
///   lamps)
/// Order 0 with `fixed` is light that cannot be turned: radiosity, the light of one job (core/meshless).
/// Shape   coefficients[(v * channels + c) * slots + i];  slots = order^2 + (fixed ? 1 : 0)
struct Transfer {
  int order = 0;
  int channels = 1;    // 1: grey (no colour bleeds), else 3
  bool fixed = false;  // a last slot with the baked light of emitters and punctual lights
  std::vector<float> coefficients;

  int slots() const { return sh_count(order) + (fixed ? 1 : 0); }
  std::size_t stride() const { return static_cast<std::size_t>(channels) * static_cast<std::size_t>(slots()); }
  std::size_t vertices() const { return stride() == 0 ? 0 : coefficients.size() / stride(); }
  const float* at(std::size_t vertex, int channel) const {
    return coefficients.data() + vertex * stride() +
           static_cast<std::size_t>(channels == 1 ? 0 : channel) * static_cast<std::size_t>(slots());
  }
};

}  // namespace kiln
