#pragma once
// Distances between the rows of a field, whatever it holds.
//   of radiance functions  equations 5 and 6 (hemisphere_norm.h) of their mean light (light_field.h)
//   of degree 0            sum over channels of a b Y_00^2, less the same over those that hold noise. For means m and
//                          half differences h of two independent draws E[m m'] - E[h h'] is the product of what was
//                          drawn: noise neither looks like detail nor hides it. Such a product may be below zero.

#include <cstdint>
#include <span>
#include <vector>

#include "core/lightfield/hemisphere_norm.h"
#include "core/lightfield/light_field.h"

namespace kiln {

class FieldProducts {
 public:
  /// Keeps a reference to the field.
  explicit FieldProducts(const LightField&);

  /// Products of the differences between `others` and v, on the hemisphere of n: element i (i + 1) / 2 + k, k <= i.
  void of_differences(std::uint32_t v, std::span<const std::uint32_t> others, const Vec3d& n,
                      std::vector<float>& products) const;
  /// Not below zero.
  double squared_norm(std::uint32_t v, const Vec3d& n) const;
  double squared_distance(std::uint32_t a, std::uint32_t b, const Vec3d& n) const;

 private:
  const LightField& field_;
  HemisphereNorm norm_;
  bool euclid_;
};

}  // namespace kiln
