#pragma once
// The progressive loop: a bake that promised an error or a time advances in passes, and each ends with a whole,
// certified artefact. After a pass the next is planned from where the error of the last came from (pass_growth.h).
// Passes begin afresh: with a growth of four the earlier ones cost a third of the last. The newest is
// delivered, not the one whose certificate was luckiest.
// Repeat  a target alone gives the same passes and bytes on any machine that is not stopped by limits.wall_s; a time
//         budget cannot.

#include <optional>
#include <string>
#include <vector>

#include "core/bake/pass_growth.h"
#include "core/bake/pass_kinds.h"
#include "core/bake/pass_record.h"
#include "core/bake/plan.h"
#include "core/bake/recipe.h"

namespace kiln {

/// What became of a promise.
struct Outlook {
  enum class Ending { target_met, time_spent, floor } ending = Ending::floor;
  std::string reason;  // a sentence: what was reached, and of a floor which knob would lower it
};

/// The passes that are still to come, were each to cost and to find what the last ones let expect.
struct Ahead {
  std::size_t passes = 0;
  double seconds = 0, next_seconds = 0;  // of all of them, of the next one
  std::uint64_t rays = 0;
  double relrmse = 0;  // that the last one reaches
  Plan plan;           // of the last one
  Outlook outlook;
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

  /// `last` is the plan of the newest pass.
  Ahead ahead(const Plan& last, const Scene& scene) const;

  const Outlook& outlook() const { return outlook_; }
  bool kept() const { return outlook_.ending != Outlook::Ending::floor; }

 private:
  std::optional<Plan> end(Outlook::Ending, std::string reason);
  double transport_target() const;
  bool transport_met() const;
  bool own_light_bound() const;  // the target bounds the job's own light too: no order was asked for
  bool stuck() const;
  double time_growth() const;
  PassGrowth growth() const { return {all_, kind_, fixed_}; }
  double most_growth(double affordable) const;
  Growth wanted(const PassGrowth&, double most) const;
  std::optional<Growth> more_rays_alone() const;
  Growth least_growth() const;
  bool idle(const Growth&) const;
  bool no_order_suffices() const;
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
  Growth chosen_;  // of the plan that next() gave last
  Outlook outlook_;
};

}  // namespace kiln
