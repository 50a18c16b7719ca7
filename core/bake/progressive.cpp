#include "core/bake/progressive.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "core/bake/light_field_step.h"
#include "core/bake/links_step.h"
#include "core/bake/radiosity_step.h"

namespace kiln {
namespace {

using Ending = Outlook::Ending;

constexpr std::size_t kMostPasses = 10;
constexpr double kMostCost = 8;       // of one pass: a wrong guess costs no more than that
constexpr double kLeastGrowth = 1.3;  // below it another pass is not worth its cost
constexpr double kShareOfWall = 0.8;  // of limits.wall_s, beyond which the job would be killed
constexpr double kMoreBands = 1.5;    // cost of two more bands of a light field
constexpr double kLessTarget = 0.8;   // of a simplification that went too far
constexpr double kMaxRays = 65536;

double square(double x) { return x * x; }

constexpr int kMoreOrders = 2;  // of one step

// What bands leave out of the job's light falls as order^-p. On the demo's column, orders 4 to 10: p = .5 under skies
// with a sun (builtin clear; mondello), 1 in a chapel with windows, above 1.5 under the courtyard.
constexpr double kUsualFall = 1, kBestFall = 1.5;

double truncation_falls(int from, int to, double power) { return std::pow(static_cast<double>(from) / to, power); }

/// The pass with the next order, had truncation fallen so. Rays take most of its time, and are as many.
PassRecord with_more_bands(PassRecord pass) {
  constexpr double kDearer = 1.3;  // two bands more; a guess
  const int order = std::min(kMaxShOrder, pass.order + kMoreOrders);
  const double falls = truncation_falls(pass.order, order, kUsualFall);
  *pass.own_relrmse *= falls, *pass.own_high *= falls;
  if (pass.sources.truncation) *pass.sources.truncation *= falls;
  pass.order = order;
  pass.seconds = pass.certificate_seconds + kDearer * pass.work();
  pass.elapsed_s += pass.seconds;
  return pass;
}

bool is_of(const PassRecord& record, const Plan& plan) {
  if (plan.field) return record.order == plan.field->outgoing.degree && record.samples == plan.field->outgoing.rays;
  if (plan.links) return record.samples == plan.radiosity->direct.sky && record.bounce_samples == plan.links->rays;
  if (plan.radiosity)
    return record.samples == plan.radiosity->direct.sky && record.bounce_samples == plan.radiosity->rays;
  return record.order == plan.order && record.samples == plan.samples && record.bounce_samples == plan.bounce_samples;
}

/// What the last pass decided while it was baked.
void forget_outcomes(Plan& plan) {
  std::erase_if(plan.decisions,
                [](const Decision& d) { return d.decision == "gathered" || d.decision == "simplified"; });
}

std::string percent(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g %%", 100 * x);
  return text;
}

}  // namespace

Passes::Passes(const Promise& promise, const FixedKnobs& fixed, const Limits& limits, const PassKind& kind)
    : promise_(promise), fixed_(fixed), limits_(limits), kind_(kind) {}

void Passes::add(const PassRecord& pass) { all_.push_back(pass); }

std::optional<Plan> Passes::end(Ending ending, std::string reason) {
  outlook_ = {ending, std::move(reason)};
  return std::nullopt;
}

/// Where no order can hold the job's own light to the target, what the bands leave out is the floor; less transport
/// error than a third of it would lower the sum of both by less than a twentieth.
double Passes::transport_target() const {
  constexpr double kThird = 1 / 3.0;
  const double target = *promise_.target_error;
  return no_order_suffices() ? std::max(target, kThird * *all_.back().sources.truncation) : target;
}

bool Passes::transport_met() const { return promise_.target_error && all_.back().high <= transport_target(); }

bool Passes::own_light_bound() const {
  return promise_.target_error && !fixed_.order && all_.back().own_high.has_value();
}

/// The last pass cost at least twice the one before it and hardly helped.
bool Passes::stuck() const {
  if (all_.size() < 3) return false;
  const PassRecord& now = all_.back();
  const PassRecord& before = all_[all_.size() - 3];
  return now.order == before.order && now.relrmse > 0.9 * before.relrmse && now.high > 0.9 * before.high &&
         now.rays > 4 * before.rays;
}

double Passes::time_growth() const {
  const PassRecord& now = all_.back();
  const double budget = promise_.time_budget_s.value_or(kShareOfWall * limits_.wall_s);
  const double reserve = std::max(0.2, 0.04 * budget);  // preview and report
  const double left = budget - reserve - now.elapsed_s - now.certificate_seconds;
  return left / now.work();
}

/// Of a light field whose degree is open: its last band holds so much that those beyond it are a part of the error.
bool Passes::bands_missing(const Plan& last) const {
  constexpr double kPart = 0.4;
  const ErrorSources& s = all_.back().sources;
  return last.field && !fixed_.order && last.field->outgoing.degree < kMaxLightFieldDegree &&
         s.truncation.value_or(0) > kPart * s.interpolation;
}

/// Of a light field: what was baked is good enough, but the certificate of the simplified file found more than those of
/// the search.
bool Passes::simplified_too_far(const Plan& last) const {
  if (!last.field || !last.field->target || *last.field->target < square(kLessTarget) * *promise_.target_error)
    return false;
  const ErrorSources& s = all_.back().sources;
  return std::hypot(s.noise, s.interpolation) < kLessTarget * *promise_.target_error;
}

std::string Passes::pass_reason() const {
  return "pass " + std::to_string(all_.size() + 1) + ", from the error of the last one";
}

std::optional<Plan> Passes::grown(const Plan& last, Growth growth, const Scene& scene) {
  Plan plan = last;
  const auto more = [](int samples, double times) {
    return static_cast<int>(std::min(kMaxRays, std::ceil(samples * times / 16) * 16));
  };
  forget_outcomes(plan);
  if (bands_missing(last)) {
    plan.field->outgoing.degree = std::min(kMaxLightFieldDegree, plan.field->outgoing.degree + 2);
    growth.triangles = std::sqrt(growth.triangles);  // the other half of the way
  }
  if (plan.field && !fixed_.reflected) {
    plan.field->outgoing.rays = more(plan.field->outgoing.rays, growth.reflected);
  } else if (!plan.field && !plan.radiosity && !fixed_.direct) {
    plan.samples = more(last.samples, growth.direct);
    plan.noise = last.noise / std::sqrt(growth.direct);
    plan.lamp_samples = more(last.lamp_samples, growth.direct);
    plan.bounce_samples = more(last.bounce_samples, growth.reflected);
  }
  if (plan.merge) {
    constexpr double kMerging = 0.25;  // of the error that is expected: a sixteenth of its square
    const double share = kMerging * std::sqrt(this->growth().predicted(growth)) / plan.merge->max_error;
    const double less = std::min(1.0, share) / growth.triangles;  // shape may be what splits do not mend
    plan.merge->max_error *= less;
    plan.merge->max_reach *= less;
    const std::uint64_t needed = triangles_for_light(triangles_for_shape(scene.mesh, plan.merge->max_reach));
    plan.merge->triangles = std::min<std::uint64_t>(scene.mesh.triangles.size(), needed);
  }
  if (growth.triangles > 1) {
    const double triangles = growth.triangles * static_cast<double>(all_.back().triangles);
    plan.subdivide.triangles = static_cast<std::uint64_t>(std::min(triangles, 5e7));
    plan.split = plan.merge || plan.subdivide.triangles > scene.mesh.triangles.size();
    if (plan.merge) plan.merge->added = 0;
  }
  if (plan.field)
    predict_grown_field(plan, growth.triangles);
  else if (plan.links)
    grow_links(plan, {growth.reflected, growth.reflected, growth.points, fixed_.eps, pass_reason()}, scene);
  else if (plan.radiosity)
    grow_radiosity(plan, {growth.direct, growth.reflected, growth.points, fixed_.eps, pass_reason()}, scene);
  else
    plan.prediction = predict(plan, scene);
  if (plan.prediction.memory_bytes > limits_.memory_mb << 20) {
    const Growth half{std::sqrt(growth.direct), std::sqrt(growth.reflected), std::sqrt(growth.points),
                      std::sqrt(growth.triangles)};
    const bool points = plan.radiosity && !plan.field;
    if (points && this->growth().cost(half) > kLeastGrowth) return grown(last, half, scene);
    if (const auto rays = more_rays_alone(); growth.triangles > 1 && rays) return grown(last, *rays, scene);
    return end(Ending::floor, "reached " + percent(all_.back().high) + "; " +
                                  (points ? "finer points, more rays or " : "") +
                                  "more triangles would need more than /limits/memory_mb");
  }
  chosen_ = growth;
  for (Decision& d : plan.decisions) {
    const std::string reason = pass_reason();
    if (d.decision == "samples") d = {"samples", std::to_string(plan.samples), reason};
    if (d.decision == "degree") d = {"degree", std::to_string(plan.field->outgoing.degree), reason};
    if (d.decision == "rays of a vertex") d = {d.decision, std::to_string(plan.field->outgoing.rays), reason};
    if (d.decision == "subdivide" && plan.split)
      d = {"subdivide", "up to " + std::to_string(plan.subdivide.triangles) + " triangles", reason};
  }
  return plan;
}

/// Ten bands would still leave out more than the target.
bool Passes::no_order_suffices() const {
  const PassRecord& now = all_.back();
  const double left_out = now.sources.truncation.value_or(0);
  return own_light_bound() && left_out * truncation_falls(now.order, kMaxShOrder, kBestFall) > *promise_.target_error;
}

std::optional<Plan> Passes::higher_order(const Plan& last, const Scene& scene) {
  const PassRecord& now = all_.back();
  if (now.order >= kMaxShOrder || no_order_suffices()) {
    return end(Ending::floor,
               std::to_string(now.order) + " bands hold the job's own light only to " + percent(*now.own_high) +
                   ", and no order up to 10 suffices for " + percent(*promise_.target_error) + "; transport reached " +
                   percent(now.high) +
                   ". A given /steps/0/order bounds transport alone, a light without a sharp sun needs fewer bands, "
                   "and the step radiosity holds any light");
  }
  if (time_growth() < kLeastGrowth) return end(Ending::time_spent, "the time ended before a higher order was baked");
  Plan plan = last;
  plan.order = std::min(kMaxShOrder, now.order + kMoreOrders);
  plan.prediction = predict(plan, scene);
  for (Decision& d : plan.decisions) {
    if (d.decision == "order")
      d = {"order", std::to_string(plan.order), "fewer bands cannot hold the job's own light to the target"};
  }
  return plan;
}

const char* Passes::fixed_knob() const {
  const ErrorSources& s = all_.back().sources;
  if (fixed_.reflected && (kind_.point == 0 || s.noise_of_reflections >= std::max(s.points, s.interpolation)))
    return kind_.rays;
  if (fixed_.points && s.points >= s.interpolation) return "/steps/0/points/radius";
  return fixed_.triangles ? "/steps/0/subdivide" : fixed_.reflected ? kind_.rays : nullptr;
}

/// What the next pass may cost, in costs of the last one. A time that is more than one pass may take: so much of it
/// that what is left is worth another one.
double Passes::most_growth(double affordable) const {
  const double step = promise_.time_budget_s ? std::min(4.0, affordable / 2.5) : kMostCost;
  return affordable > kMostCost ? step : 0.9 * affordable;
}

/// The interval ends above the error: aims so that its end meets the target.
Growth Passes::wanted(const PassGrowth& model, double most) const {
  const PassRecord& now = all_.back();
  if (promise_.target_error) {
    const double aim = *promise_.target_error * std::clamp(0.9 * now.relrmse / std::max(now.high, 1e-9), 0.3, 0.75);
    if (const Growth enough = model.towards(aim); model.cost(enough) < most) return enough;
  }
  return model.within(most);
}

/// What is left open does not lower the error.
bool Passes::idle(const Growth& growth) const {
  constexpr double kSame = 0.9;  // of the squared error
  const PassGrowth model = this->growth();
  return model.cost(growth) < 1.05 ||
         (fixed_knob() != nullptr && model.predicted(growth) > kSame * model.predicted({}));
}

/// On the same triangles, if that helps.
std::optional<Growth> Passes::more_rays_alone() const {
  constexpr double kHelps = 0.9;  // of the squared error
  FixedKnobs fixed = fixed_;
  fixed.triangles = fixed.points = true;
  const PassGrowth model(all_, kind_, fixed);
  const Growth out = wanted(model, most_growth(time_growth()));
  return model.predicted(out) < kHelps * model.predicted({}) ? std::optional(out) : std::nullopt;
}

Growth Passes::least_growth() const {
  return {kLeastGrowth, kLeastGrowth, growth().free_points() ? kLeastGrowth : 1, kLeastGrowth};
}

std::optional<Plan> Passes::next(const Plan& last, const Scene& scene) {
  chosen_ = {};
  const PassRecord& now = all_.back();
  if (last.field && last.field->carried && !transport_met()) {
    return end(
        promise_.target_error ? Ending::floor : Ending::time_spent,
        "reached " + percent(now.high) + "; the file carries its light, and nothing is baked that could be finer");
  }
  if (transport_met()) {
    if (!own_light_bound() || *now.own_high <= *promise_.target_error)
      return end(Ending::target_met, "reached " + percent(now.high) + " of " + percent(*promise_.target_error));
    return higher_order(last, scene);
  }
  const double affordable = time_growth();
  if (affordable < kLeastGrowth) {
    return promise_.time_budget_s ? end(Ending::time_spent, "the time is spent; reached " + percent(all_.back().high))
                                  : end(Ending::floor, "reached " + percent(all_.back().high) +
                                                           "; another pass would need more than /limits/wall_s");
  }
  const std::string floor =
      "reached " + percent(all_.back().high) + " of " + percent(promise_.target_error.value_or(0)) + ": ";
  if (all_.size() >= kMostPasses) return end(Ending::floor, floor + "the last of ten passes has ended");
  if (stuck()) return end(Ending::floor, floor + "neither more rays nor more triangles lower it; " + kind_.last_knob);

  if (promise_.target_error && now.sources.bounce_tail > *promise_.target_error) {
    return end(Ending::floor, floor + "reflections left out are " + percent(now.sources.bounce_tail) +
                                  " of the light; a higher /steps/0/bounces lowers it");
  }
  if (simplified_too_far(last)) {
    Plan plan = last;
    *plan.field->target *= kLessTarget;
    forget_outcomes(plan);
    return plan;
  }

  const double all = most_growth(affordable);
  Growth growth = wanted(this->growth(), bands_missing(last) ? all / kMoreBands : all);
  if (idle(growth) && !bands_missing(last)) {
    if (const char* knob = fixed_knob()) {
      return end(promise_.target_error ? Ending::floor : Ending::time_spent,
                 "reached " + percent(all_.back().high) + "; what is left comes from what the recipe fixes: " + knob);
    }
    growth = least_growth();
  }
  return grown(last, growth, scene);
}

Ahead Passes::ahead(const Plan& last, const Scene& scene) const {
  Passes to_come = *this;
  Ahead out{.relrmse = all_.back().relrmse, .plan = last};
  while (const std::optional<Plan> next = to_come.next(out.plan, scene)) {
    PassRecord pass = to_come.growth().imagined(to_come.chosen_);
    if (next->order != out.plan.order) pass = with_more_bands(pass);
    const bool same = pass.relrmse == out.relrmse && next->order == out.plan.order;
    if (out.passes == 0) out.next_seconds = pass.seconds;
    out.seconds += pass.seconds;
    out.rays += pass.rays;
    out.relrmse = pass.relrmse;
    out.plan = *next;
    ++out.passes;
    to_come.add(pass);
    if (same) break;  // what such a pass finds cannot be told
  }
  out.outlook = to_come.outlook();
  return out;
}

Plan Passes::resume(const std::vector<PassRecord>& known, Plan plan, const Scene& scene) {
  for (const PassRecord& record : known) {
    if (!is_of(record, plan)) break;  // of another input after all
    add(record);
    auto following = next(plan, scene);
    if (!following) {  // the bake was cut off between its last pass and its end: that pass is needed again
      all_.pop_back();
      break;
    }
    plan = std::move(*following);
  }
  return plan;
}

}  // namespace kiln
