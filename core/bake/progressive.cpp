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
constexpr double kMostSamples = 8, kMostTriangles = 6;  // growth of one pass,
constexpr double kMostCost = 8;                         // and of their product: a wrong guess costs no more than that
constexpr double kLeastGrowth = 1.3;                    // below it another pass is not worth its cost
constexpr double kShareOfWall = 0.8;                    // of limits.wall_s, beyond which the job would be killed
constexpr double kMoreBands = 1.5;                      // cost of two more bands of a light field
constexpr double kLessTarget = 0.8;                     // of a simplification that went too far
constexpr double kMaxRays = 65536;

double square(double x) { return x * x; }

/// What a pass costs, in shadow rays: it must not depend on a clock.
struct Parts {
  double direct, reflected, points, triangles;

  Parts(const PassRecord& pass, const PassKind& kind)
      : direct(static_cast<double>(pass.rays - pass.bounce_rays)),
        reflected(kind.gather_ray * static_cast<double>(pass.bounce_rays)),
        points(kind.point * static_cast<double>(pass.points)),
        triangles(kind.triangle * static_cast<double>(pass.triangles)) {}
  double all() const { return direct + reflected + points + triangles; }
};

/// Seconds that grow with rays and triangles.
double work(const PassRecord& pass) { return std::max(1e-3, pass.seconds - pass.certificate_seconds); }

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

bool Passes::transport_met() const { return promise_.target_error && all_.back().high <= *promise_.target_error; }

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
  return left / work(now);
}

/// Without points of their own the vertices, which are as the triangles, have the reflected rays.
double Passes::cost(Growth g) const {
  const Parts parts(all_.back(), kind_);
  if (parts.points == 0)
    return g.triangles * (parts.direct * g.direct + parts.reflected * g.reflected + parts.triangles) / parts.all();
  return (g.triangles * (parts.direct * g.direct + parts.triangles) +
          g.points * (parts.reflected * g.reflected + parts.points)) /
         parts.all();
}

/// From two passes of one order that differ in triangles; that of its kind until there are such.
double Passes::interpolation_power() const {
  if (all_.size() < 2) return kind_.power;
  const PassRecord& a = all_[all_.size() - 2];
  const PassRecord& b = all_.back();
  if (a.order != b.order || !(b.sources.interpolation > 0) || !(a.sources.interpolation > 0)) return kind_.power;
  const double growth = std::log(static_cast<double>(b.triangles) / static_cast<double>(a.triangles));
  if (growth < 0.2) return kind_.power;
  return std::clamp(std::log(a.sources.interpolation / b.sources.interpolation) / growth, 0.25, 1.0);
}

/// The squared error of a pass that has grown.
double Passes::predicted(Growth g) const {
  const ErrorSources& s = all_.back().sources;
  const double reflected = square(s.noise_of_reflections), direct = square(s.noise) - reflected;
  return direct / g.direct + reflected / g.reflected +
         square(s.interpolation) * std::pow(g.triangles, -2 * interpolation_power()) + square(s.bounce_tail) +
         square(s.quantisation) + square(s.compression) + square(s.merging) +
         square(s.points) * std::pow(g.points, -2 * kind_.points_power);
}

/// The fewest rays that leave so much noise, by Lagrange: rays of each kind as the root of noise over cost.
Passes::Growth Passes::rays_for(double noise, const Growth& places) const {
  Growth out = places;
  const ErrorSources& s = all_.back().sources;
  const Parts cost(all_.back(), kind_);
  const double dear = kind_.point > 0 ? places.points / places.triangles : 1;  // a reflected ray, beside a direct one
  const double reflected = square(s.noise_of_reflections), direct = std::max(0.0, square(s.noise) - reflected);
  const auto limited = [](double growth) { return std::clamp(growth, 1.0, kMostSamples); };
  out.direct = fixed_.direct ? 1 : kMostSamples, out.reflected = fixed_.reflected ? 1 : kMostSamples;
  if (noise <= 0 || (fixed_.direct && fixed_.reflected)) return out;
  const double reflected_cost = cost.reflected * dear;
  if (!fixed_.direct && !fixed_.reflected) {
    const double both = std::sqrt(direct * cost.direct) + std::sqrt(reflected * reflected_cost);
    const auto growth = [&](double own, double price) { return own > 0 ? std::sqrt(own / price) * both / noise : 0; };
    out.direct = limited(growth(direct, cost.direct)), out.reflected = limited(growth(reflected, reflected_cost));
  }
  if (!fixed_.reflected && (fixed_.direct || out.direct == 1))
    out.reflected = limited(noise > direct ? reflected / (noise - direct) : kMostSamples);
  if (!fixed_.direct && (fixed_.reflected || out.reflected == 1))
    out.direct = limited(noise > reflected ? direct / (noise - reflected) : kMostSamples);
  return out;
}

/// The cheapest growth that brings the error to `wanted`, or nearly as near to it as any.
Passes::Growth Passes::towards(double wanted) const {
  constexpr int kSteps = 48, kPointSteps = 24;
  constexpr double kNearly = 1.25;  // of the squared error
  std::vector<Growth> all;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= (free_triangles() ? kSteps : 0); ++i) {
    for (int k = 0; k <= (free_points() ? kPointSteps : 0); ++k) {
      Growth noiseless;
      noiseless.direct = noiseless.reflected = std::numeric_limits<double>::infinity();
      noiseless.triangles = std::pow(kMostTriangles, i / double{kSteps});
      noiseless.points = std::pow(kMostTriangles, k / double{kPointSteps});
      const Growth growth = rays_for(square(wanted) - predicted(noiseless), noiseless);
      least = std::min(least, predicted(growth));
      all.push_back(growth);
    }
  }
  const double near = std::max(square(wanted) * (1 + 1e-9), kNearly * least);
  std::erase_if(all, [&](const Growth& g) { return predicted(g) > near; });
  return *std::ranges::min_element(all, {}, [&](const Growth& g) { return cost(g); });
}

/// The lowest error that a cost of `most` buys.
Passes::Growth Passes::within(double most) const {
  double cheap = std::max(all_.back().relrmse, 1e-6), dear = cheap / 64;
  for (int i = 0; i < 32; ++i) {
    const double middle = std::sqrt(cheap * dear);
    (cost(towards(middle)) > most ? dear : cheap) = middle;
  }
  return towards(cheap);
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
    const double share = kMerging * std::sqrt(predicted(growth)) / plan.merge->max_error;
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
    if (points && cost(half) > kLeastGrowth) return grown(last, half, scene);
    return end(Ending::floor, "reached " + percent(all_.back().high) + "; " +
                                  (points ? "finer points, more rays or " : "") +
                                  "more triangles would need more than /limits/memory_mb");
  }
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

/// Truncation falls about as order^-1.5 under skies with a sun: an order is tried only if ten bands may do.
std::optional<Plan> Passes::higher_order(const Plan& last, const Scene& scene) {
  constexpr int kStep = 2;
  const PassRecord& now = all_.back();
  const double at_ten = *now.own_relrmse * std::pow(static_cast<double>(now.order) / kMaxShOrder, 1.5);
  if (now.order >= kMaxShOrder || at_ten > *promise_.target_error) {
    return end(Ending::floor, "transport reached " + percent(now.high) + " of " + percent(*promise_.target_error) +
                                  ", but " + std::to_string(now.order) + " bands hold the job's own light only to " +
                                  percent(*now.own_high) +
                                  ": no order up to 10 suffices; a given /steps/0/order bounds transport alone");
  }
  if (time_growth() < kLeastGrowth) return end(Ending::time_spent, "the time ended before a higher order was baked");
  Plan plan = last;
  plan.order = std::min(kMaxShOrder, now.order + kStep);
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

std::optional<Plan> Passes::next(const Plan& last, const Scene& scene) {
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

  // The interval ends above the error: aim so that its end meets the target.
  // A time that is more than one pass may take: so much of it that what is left is worth another one.
  const double step = promise_.time_budget_s ? std::min(4.0, affordable / 2.5) : kMostCost;
  const double all = affordable > kMostCost ? step : 0.9 * affordable;
  const double most = bands_missing(last) ? all / kMoreBands : all;
  Growth growth = within(most);
  if (promise_.target_error) {
    const double aim = *promise_.target_error * std::clamp(0.9 * now.relrmse / std::max(now.high, 1e-9), 0.3, 0.75);
    if (const Growth wanted = towards(aim); cost(wanted) < most) growth = wanted;
  }
  constexpr double kIdle = 0.9;  // of the squared error: what is left open does not lower it
  const bool idle = cost(growth) < 1.05 || (fixed_knob() != nullptr && predicted(growth) > kIdle * predicted({}));
  if (idle && !bands_missing(last)) {
    if (const char* knob = fixed_knob()) {
      return end(promise_.target_error ? Ending::floor : Ending::time_spent,
                 "reached " + percent(all_.back().high) + "; what is left comes from what the recipe fixes: " + knob);
    }
    growth = {kLeastGrowth, kLeastGrowth, free_points() ? kLeastGrowth : 1, kLeastGrowth};
  }
  return grown(last, growth, scene);
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
