#pragma once
// What another pass would cost and what error it would leave, told from the last ones.
//
//   noise of direct and of reflected light ~ 1 / sqrt(rays a vertex that each takes),  interpolation ~ triangles^-p,
//   cost ~ triangles (a + rays of direct light + b rays of reflected light)
// Where reflected light lives on points (core/meshless) its rays are theirs, they cost some themselves, and what is
// read of them is off by points^-q. Of all growths of these that reach a wanted error the cheapest is taken.

#include <span>

#include "core/bake/pass_kinds.h"
#include "core/bake/pass_record.h"

namespace kiln {

/// How many times what the last pass had.
struct Growth {
  double direct = 1, reflected = 1, points = 1, triangles = 1;  // rays, and where they start
};

class PassGrowth {
 public:
  /// Of the passes so far, one at least; keeps references to all three.
  PassGrowth(std::span<const PassRecord> passes, const PassKind&, const FixedKnobs&);

  double cost(Growth) const;                  // in costs of the last pass
  double predicted(Growth) const;             // the squared error
  Growth towards(double wanted_error) const;  // the cheapest, or nearly as near to it as any
  Growth within(double most) const;           // the lowest error that a cost of `most` buys
  /// The pass itself, had the last ones told the truth.
  PassRecord imagined(Growth) const;

  bool free_points() const { return kind_.point > 0 && !fixed_.points; }

 private:
  Growth rays_for(double noise_squared, const Growth& places) const;
  double interpolation_power() const;
  const PassRecord& last() const { return passes_.back(); }

  std::span<const PassRecord> passes_;
  const PassKind& kind_;
  const FixedKnobs& fixed_;
};

}  // namespace kiln
