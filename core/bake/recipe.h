#pragma once
// A recipe: what a user asks of a bake, parsed once into types. contract.md section 4 is its outside.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "core/grid/grid.h"
#include "core/lightfield/collapse_cost.h"
#include "core/lightfield/radiance_function.h"
#include "core/prt/subdivide.h"
#include "core/reduce/reduce_method.h"

namespace kiln {

/// One mistake in a JSON document. A document's mistakes are reported together.
struct FieldError {
  std::string pointer;   // RFC 6901: "/steps/0/order"
  std::string detail;    // "must be an integer from 1 to 10"
  std::string received;  // compact JSON of what stood there; empty when missing
  std::string allowed;   // what may stand there
};

struct EnvironmentChoice {
  enum class Kind { none, constant, asset, file, builtin } kind = Kind::none;
  Vec3f constant;
  std::string name;  // sha256 of the asset, path of the file, or name of the built-in sky
  float rotation_deg = 0;
  float intensity = 1;
};

struct PrtStep {
  std::optional<int> order;  // auto when absent
  std::optional<int> bounces;
  std::optional<int> samples;
  struct Subdivision {
    enum class Mode { automatic, off, on } mode = Mode::automatic;  // automatic: the plan gives budget and threshold
    SplitMeasure measure = SplitMeasure::residual;
    float alpha = 1;
    std::optional<float> threshold;
    std::optional<std::uint64_t> triangles;  // budget of the final mesh
    int max_depth = 8;
  };
  Subdivision subdivide;
  struct Encoding {
    enum class Form { automatic, raw, components } form = Form::automatic;  // "auto", "raw", "pca"
    std::optional<int> rank;                                                // numbers of components
    std::optional<int> bits;                                                // of each stored number
  };
  Encoding encoding;
  enum class Glossy {
    automatic,
    on,
    off
  } glossy = Glossy::automatic;  // matrices: where they show, everywhere, nowhere
  enum class Merge {
    automatic,
    on,
    off
  } merge = Merge::automatic;  // vertices that light and shape do not need: where they are many, always, never
  struct Meshless {
    std::optional<double> radius;  // of the coarsest points, in metres; auto when absent
    std::optional<int> levels;
    std::optional<double> eps_transfer;  // eps_T of core/meshless/glossy_points.h
  };
  std::optional<Meshless> meshless;  // solver: meshless; else light is gathered at the vertices
};

/// Light of one job at the vertices: no order, nothing to turn (core/meshless/radiosity.h).
struct RadiosityStep {
  enum class Scheme { rows, paper } scheme = Scheme::rows;  // of the step `radiosity`
  std::optional<double> eps_solid_angle;                    // of the paper's scheme, sr
  std::optional<double> radius;                             // of the coarsest points, in metres; auto when absent
  std::optional<int> levels;
  std::optional<double> eps_irradiance;  // prediction error that asks for finer points, of the mean light
  std::optional<int> rays;               // of a gather
  std::optional<int> bounces;
  PrtStep::Subdivision subdivide;
  struct Deliver {
    bool vertices = true, lightmap = false, points = false;
  };
  Deliver deliver;                   // of the step `radiosity`
  std::optional<int> lightmap_size;  // texels along a side; auto when absent
};

/// Irradiance vectors over a lattice (core/grid/bake_grid.h), and the scene lit as by RadiosityStep.
struct GridStep {
  std::optional<std::array<int, 3>> resolution;  // vertices along x, y, z; auto when absent
  GridContent content = GridContent::indirect;
  GridBlend blend = GridBlend::exact;
  std::optional<int> bounces;  // reflections
  std::optional<int> samples;  // rays of a vertex
};

/// Links for lights that move (core/meshless/link_builder.h), and the scene lit as by RadiosityStep.
struct TransportStep {
  RadiosityStep surface;            // what the two have in common
  std::optional<int> sender_level;  // the finest level of points that send; auto when absent
};

/// How a light field holds the sky (kept_apart.h).
enum class SkyPart { automatic, apart, series };

/// Radiance towards every eye at the vertices (core/lightfield/outgoing.h), under the light of one job.
struct LightFieldStep {
  RadiosityStep surface;  // bounces and subdivision; the rest is automatic
  RadianceBasis basis = RadianceBasis::harmonics;
  SkyPart sky = SkyPart::automatic;
  std::optional<int> degree;  // bands 0 .. degree
  std::optional<int> rays;    // of a vertex
  struct Simplification {     // auto when none of the three is given
    bool off = false;
    std::optional<double> ratio;             // of the baked triangles
    std::optional<std::uint64_t> triangles;  // of the result
    std::optional<double> max_error;         // relRMSE that it may add, as simplify.h estimates it
    Collapse collapse = Collapse::edge;
    double geometry_weight = 0.01;
  } simplify;
  int lods = 0;
  bool progressive = false;
};

/// Fewer triangles, and a normal map for what they do not hold (core/reduce/reduce.h).
struct ReduceStep {
  std::optional<std::uint64_t> triangles;  // auto when this and `ratio` are absent
  std::optional<double> ratio;             // of the model's triangles
  ReduceMethod method = ReduceMethod::adaptive;
  std::optional<int> normal_map;  // texels along a side; 0: none; auto when absent
  int normal_bits = 8;            // of the map: 8 or 16
};

enum class Quality { draft, standard, finest };  // "draft", "standard", "final"

/// What a bake must reach instead of a quality: the error its certificate proves, the time it may take, or whichever of
/// both comes first.
struct Promise {
  std::optional<double> target_error;   // relRMSE: the upper end of the certificate's interval
  std::optional<double> time_budget_s;  // of the whole bake
  explicit operator bool() const { return target_error || time_budget_s; }
};

struct Limits {
  std::uint64_t memory_mb = 4096;
  int threads = 0;
  double wall_s = 3600;
};

struct Recipe {
  std::string scene_asset;  // sha256; empty when the scene is given otherwise
  EnvironmentChoice environment;
  std::vector<PrtStep> steps;                 // one, or none where there is a
  std::optional<RadiosityStep> radiosity;     // step `radiosity`
  std::optional<GridStep> grid;               // step `grid`
  std::optional<TransportStep> transport;     // step `transport`
  std::optional<LightFieldStep> light_field;  // step `lightfield`
  std::optional<ReduceStep> reduce;           // step `reduce`: alone, or before one of the others
  Quality quality = Quality::standard;        // where nothing is promised
  Promise promise;
  std::uint64_t seed = 0;
  Limits limits;
  bool strict = false;
  bool certificate = true;
  std::string label;

  bool bakes_light() const { return !steps.empty() || radiosity || grid || transport || light_field; }
  /// The pointer of the step that bakes light: reduce comes before it.
  std::string light_step() const { return reduce ? "/steps/1" : "/steps/0"; }
};

/// Parses and checks a recipe. All mistakes at once.
tl::expected<Recipe, std::vector<FieldError>> parse_recipe(std::string_view json);

/// The recipe as canonical JSON (every field but glossy: auto, sorted keys): equal recipes give equal text.
std::string recipe_json(const Recipe&);

/// The part of recipe_json that decides the artefacts' bytes (no label, no limits, no scene): a key for result caches.
std::string recipe_identity(const Recipe&);

/// The JSON Schema (draft 7) that parse_recipe enforces, and the named presets (name -> recipe JSON).
std::string recipe_schema();
struct Preset {
  std::string name, description, recipe;
};
const std::vector<Preset>& presets();

}  // namespace kiln
