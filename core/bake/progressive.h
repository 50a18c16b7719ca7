#pragma once
// The progressive loop: a bake that promised an error or a time advances in passes, and each ends with a whole,
// certified artefact. After a pass the next is planned from where the error of the last came from.
//
//   noise of direct and of reflected light ~ 1 / sqrt(rays a vertex that each takes),  interpolation ~ triangles^-p,
//   cost ~ triangles (a + rays of direct light + b rays of reflected light)
// Where reflected light lives on points (core/meshless) its rays are theirs, they cost some themselves, and what is
// read of them is off by points^-q. Of all growths of these that reach a wanted error the cheapest is taken. Passes
// begin afresh: with a growth of four the earlier ones cost a third of the last. The newest is delivered, not the one
// whose certificate was luckiest. Repeat  a target alone gives the same passes and bytes on any machine that is not
// stopped by limits.wall_s; a time
//         budget cannot.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/bake/certificate.h"
#include "core/bake/error_sources.h"
#include "core/bake/pass_kinds.h"
#include "core/bake/plan.h"
#include "core/bake/recipe.h"

namespace kiln {

/// What one pass spent and reached.
struct PassRecord {
  int order = 0, samples = 0, bounce_samples = 0, bounces = 0;
  std::uint64_t triangles = 0, vertices = 0;    // of the result
  std::uint64_t rays = 0, bounce_rays = 0;      // of all, those between surfaces
  double seconds = 0, certificate_seconds = 0;  // all of it, and the part that does not grow with the work
  double elapsed_s = 0;                         // of the bake when the pass ended
  std::uint64_t points = 0, gathered = 0;       // that reflected light lives on; those of them with rays of their own
  double relrmse = 0, low = 0, high = 0;        // transport, with its interval
  std::optional<double> own_relrmse, own_high;  // under the job's own light in full
  ErrorSources sources;
};

/// What became of a promise.
struct Outlook {
  enum class Ending { target_met, time_spent, floor } ending = Ending::floor;
  std::string reason;  // a sentence: what was reached, and of a floor which knob would lower it
};

/// The passes of one bake.
class Passes {
 public:
  Passes(const Promise&, const FixedKnobs&, const Limits&, const PassKind& = {});

  void add(const PassRecord&);
  const std::vector<PassRecord>& all() const { return all_; }

  /// The plan of the next pass; nothing when the promise is kept or cannot be, as outlook() then says.
  /// `last` is the plan of the newest pass, `scene` has the input's mesh. Follows from the records alone.
  std::optional<Plan> next(const Plan& last, const Scene& scene);

  /// Takes up the passes that an earlier bake of the same input recorded; the plan of the one to go on with.
  Plan resume(const std::vector<PassRecord>& known, Plan first, const Scene& scene);

  const Outlook& outlook() const { return outlook_; }
  bool kept() const { return outlook_.ending != Outlook::Ending::floor; }

 private:
  struct Growth {
    double direct = 1, reflected = 1, points = 1, triangles = 1;  // rays, and where they start
  };
  std::optional<Plan> end(Outlook::Ending, std::string reason);
  bool transport_met() const;
  bool own_light_bound() const;  // the target bounds the job's own light too: no order was asked for
  bool stuck() const;
  bool free_triangles() const { return !fixed_.triangles; }
  bool free_points() const { return kind_.point > 0 && !fixed_.points; }
  double time_growth() const;
  Growth rays_for(double noise_squared, const Growth& places) const;
  double cost(Growth) const;  // in costs of the last pass
  double predicted(Growth) const;
  double interpolation_power() const;
  Growth towards(double wanted) const;
  Growth within(double most) const;
  bool bands_missing(const Plan& last) const;
  bool simplified_too_far(const Plan& last) const;
  std::optional<Plan> higher_order(const Plan& last, const Scene&);
  std::optional<Plan> grown(const Plan& last, Growth, const Scene&);
  std::string pass_reason() const;
  const char* fixed_knob() const;  // that hinders

  Promise promise_;
  FixedKnobs fixed_;
  Limits limits_;
  PassKind kind_;
  std::vector<PassRecord> all_;
  Outlook outlook_;
};

}  // namespace kiln
