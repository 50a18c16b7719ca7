#pragma once
// The series that fits best what a rough surface sends to all eyes, for light from one direction.
//   c = argmin  integral over the half space of n of (sum_i c_i Y_i - L~)^2
//             + kBelow x the same over the other half, where L~ goes on as at the horizon (1)
// L~ is the r-RF (light_field.h), linear in the light, so that fits of single directions add up to the fit of all that
// arrives: each ray of a vertex serves all eyes, and no noise is fitted in between.
// Lobe    f(w, v) (n.w) for a unit of light, as F0 a + b: the parts of Schlick's Fresnel (core/trace/ggx.h). It is even
//         about the plane of w, so that its fit over azimuth 0 has only m >= 0, and turns with w.
// Diffuse 1 - E(n.v): what a specular layer of F0 = .04 leaves to the diffuse one below (lobe_table.h).
// Paper   Vanhoey et al. 2013 (regularised fits), 2015 section 7 (prolongation below the horizon).
// Error   at most three hundredths more than that of the best series over the half space alone (measured by its test)
// Cost    3 million evaluations of Y for all finishes, once: 1.1 s of one core at degree 4, 1.5 at 8; .3 s for one
// finish

#include <cstddef>
#include <span>
#include <vector>

#include "core/base/threads.h"
#include "core/base/vec.h"

namespace kiln {

inline constexpr int kFitRows = 33, kFitColumns = 65;
inline constexpr double kBelow = 0.003;

/// Of one roughness. Number k of (l, m), m = 0 .. l, is k = l (l + 1) / 2 + m.
struct LobeFit {
  int degree = 0;
  std::vector<float> lobe;     // [column][a, b][k]; column = (kFitColumns - 1) (angle of incidence) / (pi / 2)
  std::vector<float> diffuse;  // [l], of m = 0
  static std::size_t count(int degree) { return static_cast<std::size_t>((degree + 1) * (degree + 2) / 2); }
};

/// Limited to [0, 1].
struct RoughnessRange {
  double least = 0, most = 1;
};

class LobeFits {
 public:
  /// For what is as rough as `range` says.
  LobeFits(int degree, Threads&, const RoughnessRange& range = {});
  int degree() const { return degree_; }
  /// In between by interpolation; within the range.
  LobeFit at(double roughness) const;

 private:
  int degree_;
  std::vector<LobeFit> rows_;  // empty where the range needs none
};

/// Light of many directions on its way through one lobe, in the frame of the normal.
class LobeSum {
 public:
  explicit LobeSum(const LobeFit&);
  /// `light` is that of a plane that faces l, W m^-2. Nothing where l is not above the surface.
  void add(const Vec3f& l, const Vec3f& light);
  /// The r-RF's coefficients in the frame of the normal, (degree + 1)^2 for each channel: specular light of F0, and
  /// `below` x the diffuse layer. `scale` times the sum.
  void finish(const Vec3f& f0, const Vec3f& below, float scale, std::span<float> out) const;
  void clear();

 private:
  const LobeFit& fit_;
  std::vector<float> sums_;  // [channel][a, b][k][cosine, sine]
};

}  // namespace kiln
