#pragma once
// Directions towards the bright parts of an environment map.
//
// Method  a grid of at most 1024 x 512 cells of the map, each as likely as the light in it; uniform in solid angle
// inside. Repeat  a pure function of its arguments.

#include <vector>

#include "core/scene/environment.h"

namespace kiln {

class EnvironmentSampler {
 public:
  explicit EnvironmentSampler(const Environment&);

  /// False when there is nothing to choose: a constant or black sky.
  bool useful() const { return total_ > 0; }
  /// A unit direction away from the scene; `u` uniform in [0, 1)^2. Only when useful.
  Vec3d sample(const Vec2<double>& u) const;
  /// Probability of `sample` per solid angle, 0 when not useful.
  double density(const Vec3d& w) const;

 private:
  double height_at(int row) const;  // y of the upper border of a row of cells

  int width_ = 0, height_ = 0;
  double cosine_ = 1, sine_ = 0;  // of the map's rotation
  double total_ = 0;
  std::vector<double> rows_;   // light of all rows up to this one
  std::vector<double> cells_;  // light of the row's cells up to this one
};

}  // namespace kiln
