#include "core/bake/pass_kinds.h"

namespace kiln {

/// Measured on the helmet at standard: .31 us a shadow ray, .47 us one of the field, 65 us of splits and simplification
/// a triangle. Half of the error is in places between vertices, the rest in bands: it falls slower.
PassKind light_field_passes() {
  return {.gather_ray = 1.5,
          .triangle = 200,
          .power = 0.5,
          .rays = "/steps/0/rays",
          .last_knob = "what smooth surfaces mirror of edges is soft whatever the knobs"};
}

PassKind radiosity_passes() {
  return {.gather_ray = 4,
          .triangle = 300,
          .rays = "/steps/0/rays",
          .point = 400,
          .last_knob = "a higher /steps/0/subdivide/max_depth may"};
}

PassKind links_passes() {
  return {.gather_ray = 4,
          .triangle = 300,
          .rays = "/steps/0/rays",
          .point = 2000,
          .points_power = 0.5,
          .last_knob = "a lamp near a surface makes a spot that is smaller than the cells of 48000 senders"};
}

PassKind passes_of(const Recipe& recipe) {
  if (recipe.light_field) return light_field_passes();
  if (recipe.transport) return links_passes();
  return recipe.radiosity ? radiosity_passes() : PassKind{};
}

FixedKnobs fixed_knobs(const Recipe& recipe) {
  const auto fixed = [](const PrtStep::Subdivision& s) {
    return s.mode == PrtStep::Subdivision::Mode::off || s.triangles.has_value();
  };
  FixedKnobs out;
  if (recipe.light_field) {
    const LightFieldStep& step = *recipe.light_field;
    out.order = step.degree.has_value();
    out.direct = out.reflected = step.rays.has_value();
    out.triangles = fixed(step.surface.subdivide);
  } else if (recipe.radiosity || recipe.transport) {
    const RadiosityStep& step = recipe.radiosity ? *recipe.radiosity : recipe.transport->surface;
    out.order = true;
    out.direct = recipe.transport.has_value();  // what links bring has none
    out.reflected = step.rays.has_value();
    out.points = step.radius.has_value(), out.eps = step.eps_irradiance.has_value();
    out.triangles = fixed(step.subdivide);
  } else if (!recipe.steps.empty()) {
    const PrtStep& step = recipe.steps.front();
    out.order = step.order.has_value();
    out.direct = out.reflected = step.samples.has_value();
    out.triangles = fixed(step.subdivide);
  }
  return out;
}

}  // namespace kiln
