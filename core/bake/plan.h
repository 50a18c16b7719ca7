#pragma once
// What a bake will model and what it leaves out, decided from cheap measurements, each with its reason.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/bake/forecast.h"
#include "core/bake/glossy_plan.h"
#include "core/bake/merge_plan.h"
#include "core/bake/meshless_plan.h"
#include "core/bake/recipe.h"
#include "core/base/threads.h"
#include "core/grid/bake_grid.h"
#include "core/lightfield/outgoing.h"
#include "core/lightfield/simplify.h"
#include "core/meshless/link_builder.h"
#include "core/meshless/radiosity.h"
#include "core/prt/subdivide.h"
#include "core/scene/environment.h"
#include "core/scene/scene.h"

namespace kiln {

struct Decision {
  std::string decision;  // "order", "bounces", ...
  std::string value;     // "6"
  std::string reason;
};

/// What the step `lightfield` will do beside `radiosity`, or instead where the file carries its light.
struct FieldPlan {
  bool carried = false;
  RadianceBasis basis = RadianceBasis::harmonics;  // of the fit
  OutgoingBake outgoing;
  double storage = 0.01;             // relRMSE that components and rounding may add
  std::optional<Simplify> simplify;  // what the delivered scene goes through
  std::optional<double> ratio;       // of the baked triangles: simplify->triangles, once they are known
  std::optional<double> target;      // relRMSE: simplified as far as the certificate allows (light_field_levels.h)
  int lods = 0;                      // coarser levels, each of a quarter of the triangles before it
  bool progressive = false;          // KILN_progressive_mesh
  Prediction surface;                // of the bake but for the field
};

/// The lightmap of the step `radiosity` (lightmap_step.h).
struct LightmapPlan {
  int side = 0;             // texels
  std::vector<char> parts;  // of the scene: whether it shows them
  std::vector<Vec2f> uv1;   // of the input's vertices, as delivered; empty: as they came
};

struct Plan {
  int order = 6;
  int bounces = 0;
  bool bounces_asked = false;      // by the recipe: then never skipped
  double tail_left = 0;            // share of the light in later reflections; 0 where the recipe says how many
  int samples = 1024;              // most rays per point for distant light
  double noise = 0;                // relRMSE of these rays at which a point stops; 0: never
  int bounce_samples = 256;        // rays per vertex and bounce
  int lamp_samples = 64;           // shadow rays per point over all emitters
  bool lamps = false;              // the scene has light of its own
  std::optional<MergePlan> merge;  // before splits
  bool split = false;              // subdivide at all
  Subdivide subdivide;
  PrtStep::Encoding encoding;
  int raw_bits = 12;           // of coefficients, where the encoding leaves them open
  double compression = 0.005;  // relRMSE that components may add
  GlossyPlan glossy;
  std::optional<MeshlessPlan> meshless;    // solver of the step `prt`
  std::optional<Radiosity> radiosity;      // of the step `radiosity`; order is 0 then
  std::uint64_t triangles_of_quality = 0;  // added where light changes, by `radiosity` where the recipe does not say
  std::optional<LightmapPlan> lightmap;    // of the step `radiosity`
  std::optional<GridBake> grid;            // of the step `grid`; `radiosity` is there too
  std::optional<LinkParams> links;         // of the step `transport`; `radiosity` is there too
  std::optional<FieldPlan> field;          // of the step `lightfield`; `radiosity` is there too, unless carried
  std::vector<Decision> decisions;
  std::vector<Warning> warnings;  // what this plan does not honour; beside those of the scene
  PointCosts costs;
  Prediction prediction;
};

void decide(Plan&, std::string decision, std::string value, std::string reason);
/// Three digits, for reasons.
std::string short_text(double);

/// What a bake spends where the recipe does not say.
struct Effort {
  std::string reason;  // "the standard quality"
  int order = 6, samples = 1024, bounce_samples = 256, lamp_samples = 256;
  double tail = 0.002;          // of the light that may be left out beyond the last bounce
  std::uint64_t triangles = 0;  // added where light changes
  float threshold = 0;          // of the residual measure; see subdivide.h
  int bits = 12;
  double noise = 0.01;         // of direct light at a point, as relRMSE: a fifth of the error the quality is for
  double compression = 0.005;  // relRMSE: a tenth of the error that the quality is for
  double merging = 0.005;      // relRMSE, by its estimate: a tenth too, a quarter of what is promised
};

Effort effort_of(Quality);
/// Of the first, coarse pass towards a promise (progressive.h).
Effort first_effort(const Promise&);

/// Traces a few thousand paths to see how many reflections matter, unless the step says, and a pilot (forecast.h).
Plan make_plan(const Scene&, const PrtStep&, const Effort&, Threads&);

}  // namespace kiln
