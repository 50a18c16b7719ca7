#pragma once
// What the progressive loop (progressive.h) knows of each step: prices, powers, and what a recipe leaves it to spend
// on.

#include "core/bake/recipe.h"

namespace kiln {

/// What differs between the steps that are baked in passes.
struct PassKind {
  double gather_ray = 4, triangle = 300;  // costs of a ray between surfaces and of a triangle, in shadow rays: measured
  double power = 0.75;                    // of interpolation over triangles, until two passes tell
  const char* rays = "/steps/0/samples";  // the knob of the noise,
  double point = 0, points_power = 0.75;  // as of triangles; 0: there are none, and a vertex has the reflected rays
  const char* last_knob = "a higher /steps/0/subdivide/max_depth may";  // and what is left where none helps
};
/// Of a light field: `order` of a record is its degree, `samples` the rays of a vertex, `bounce_rays` all of them.
PassKind light_field_passes();
/// Of radiosity `samples` of a record are the sky's rays at a vertex, `bounce_samples` the rays of a gather.
PassKind radiosity_passes();
/// Of transport `samples` are the same, `bounce_samples` the rays of a row, `points` and `gathered` senders and
/// receivers.
PassKind links_passes();
PassKind passes_of(const Recipe&);

/// Which of its knobs the recipe fixes.
struct FixedKnobs {
  bool order = false;  // or degree
  bool direct = false, reflected = false;
  bool points = false, eps = false;
  bool triangles = false;
};
FixedKnobs fixed_knobs(const Recipe&);

}  // namespace kiln
