#pragma once
// How much of the sky a place sees in each direction, as few harmonics, from rays that saw it or did not.
//   c = argmin  mean over even rays of (c . Y - seen)^2 + the same by the light of the sky + kRidge |c - c_0|^2     (1)
// c_0 is the constant that is the mean: where all is seen or nothing, c is just that.
// Repeat  a pure function of what was added, in its order

#include <array>

#include "core/lightfield/mirrored_sky.h"

namespace kiln {

class VisibilityFit {
 public:
  /// `even`: one of the rays that cover the half space evenly. `light`: of the sky, that the ray stands for.
  void add(const Vec3f& w, bool even, double light, bool seen);
  SkyVisibility fit() const;

 private:
  struct Moments {
    std::array<double, kVisibilityCount * kVisibilityCount> products{};  // lower triangle
    std::array<double, kVisibilityCount> seen{};
    double all = 0;
    void add(const std::array<double, kVisibilityCount>& y, double weight, bool seen);
  };
  Moments even_, light_;
};

}  // namespace kiln
