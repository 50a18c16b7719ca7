#include "core/bake/recipe.h"

#include <nlohmann/json.hpp>

#include "core/bake/json_fields.h"
#include "core/lightfield/light_field.h"
#include "core/sphere/sh.h"

namespace kiln {
namespace {

using Errors = std::vector<FieldError>;
using nlohmann::json;

constexpr std::int64_t kMaxBudget = 50'000'000;
constexpr int kMostGridSide = 512;
constexpr int kLeastMapSide = 64, kMostMapSide = 8192;
constexpr double kWholeSphere = 12.566370614359172;  // sr
constexpr int kLeastLightmap = 16, kMostLightmap = 8192;
constexpr std::int64_t kMaxExactInteger = 9'007'199'254'740'991;  // 2^53 - 1: what a JSON number holds everywhere

bool is_sha256(const std::string& text) {
  return text.size() == 64 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

std::string read_asset(JsonFields& fields) {
  const auto asset = fields.text("asset", 64);
  if (!asset) return {};
  if (!is_sha256(*asset)) fields.error("asset", "must be a SHA-256 in lower-case hex", "64 hex digits");
  return *asset;
}

std::optional<Vec3f> read_rgb(JsonFields& fields, const std::string& name) {
  const json* field = fields.find(name);
  if (!field) return std::nullopt;
  Vec3f rgb;
  bool good = field->is_array() && field->size() == 3;
  for (std::size_t i = 0; good && i < 3; ++i) {
    good = (*field)[i].is_number();
    if (!good) break;
    const double x = (*field)[i].get<double>();
    good = x >= 0 && x <= 1e9;
    rgb[i] = static_cast<float>(x);
  }
  if (good) return rgb;
  fields.error(name, "must be three numbers from 0 to 1e9", "[r, g, b]");
  return std::nullopt;
}

EnvironmentChoice read_environment(const json& value, Errors& errors) {
  using Kind = EnvironmentChoice::Kind;
  EnvironmentChoice choice;
  JsonFields fields(value, "/environment", errors);
  int sources = 0;
  const auto note = [&](Kind kind, std::string name) {
    choice.kind = kind;
    choice.name = std::move(name);
    ++sources;
  };
  if (fields.has("asset")) note(Kind::asset, read_asset(fields));
  if (fields.has("file")) note(Kind::file, fields.text("file", 4096).value_or(""));
  if (const auto rgb = read_rgb(fields, "constant")) {
    note(Kind::constant, "");
    choice.constant = *rgb;
  }
  constexpr const char* kSkies[] = {"uniform", "overcast", "clear", "courtyard"};
  if (const auto sky = fields.word("builtin", {kSkies[0], kSkies[1], kSkies[2], kSkies[3]}))
    note(Kind::builtin, kSkies[*sky]);
  choice.rotation_deg = static_cast<float>(fields.number("rotation_deg", -360, 360).value_or(0));
  choice.intensity = static_cast<float>(fields.number("intensity", 0, 1e9).value_or(1));
  fields.finish();
  if (sources > 1 && value.is_object()) {
    errors.push_back(
        {"/environment", "names more than one light", shown(value), "one of asset, file, constant, builtin"});
  }
  return choice;
}

PrtStep::Subdivision read_subdivision(const json& value, const std::string& pointer, Errors& errors) {
  using Mode = PrtStep::Subdivision::Mode;
  PrtStep::Subdivision out;
  if (value.is_string()) {
    const auto& word = value.get_ref<const std::string&>();
    out.mode = word == "off" ? Mode::off : Mode::automatic;
    if (word != "off" && word != "auto")
      errors.push_back({pointer, "must be auto, off or an object", shown(value), "auto, off, object"});
    return out;
  }
  out.mode = Mode::on;
  JsonFields fields(value, pointer, errors);
  constexpr SplitMeasure kMeasures[] = {SplitMeasure::residual, SplitMeasure::eq2, SplitMeasure::eq3,
                                        SplitMeasure::eq4};
  if (const auto measure = fields.word("measure", {"residual", "eq2", "eq3", "eq4"})) out.measure = kMeasures[*measure];
  out.alpha = static_cast<float>(fields.number("alpha", 0, 1e6).value_or(1));
  if (const auto threshold = fields.number("threshold", 0, 1e30)) out.threshold = static_cast<float>(*threshold);
  if (const auto triangles = fields.integer_or_auto("triangles", 1, kMaxBudget))
    out.triangles = static_cast<std::uint64_t>(*triangles);
  out.max_depth = static_cast<int>(fields.integer("max_depth", 0, 16).value_or(8));
  fields.finish();
  return out;
}

PrtStep::Encoding read_encoding(const json& value, const std::string& pointer, Errors& errors) {
  using Form = PrtStep::Encoding::Form;
  PrtStep::Encoding out;
  JsonFields fields(value, pointer, errors);
  constexpr Form kForms[] = {Form::automatic, Form::raw, Form::components};
  if (const auto form = fields.word("form", {"auto", "raw", "pca"})) out.form = kForms[*form];
  if (const auto rank = fields.integer_or_auto("rank", 1, 3 * kMaxShOrder * kMaxShOrder)) {
    out.rank = static_cast<int>(*rank);
    if (out.form == Form::raw) fields.error("rank", "means nothing where the form is raw", "form: pca");
  }
  if (const auto bits = fields.integer_or_auto("bits", 4, 20)) out.bits = static_cast<int>(*bits);
  fields.finish();
  return out;
}

/// Of solver: meshless; with vertices its fields mean nothing.
std::optional<PrtStep::Meshless> read_meshless(JsonFields& fields, const std::string& pointer, Errors& errors) {
  const bool meshless = fields.word("solver", {"vertices", "meshless"}) == 1;
  PrtStep::Meshless out;
  const json* points = fields.find("points");
  if (points != nullptr) {
    JsonFields inner(*points, pointer + "/points", errors);
    out.radius = inner.number_or_auto("radius", 1e-9, 1e12);
    if (const auto levels = inner.integer_or_auto("levels", 1, 12)) out.levels = static_cast<int>(*levels);
    inner.finish();
  }
  out.eps_transfer = fields.number_or_auto("eps_transfer", 0, 1e6);
  if (meshless) return out;
  constexpr const char* kNothing = "means nothing where the solver is vertices";
  if (points != nullptr) fields.error("points", kNothing, "solver: meshless");
  if (fields.find("eps_transfer") != nullptr) fields.error("eps_transfer", kNothing, "solver: meshless");
  return std::nullopt;
}

PrtStep read_prt(JsonFields& fields, const std::string& pointer, Errors& errors) {
  PrtStep step;
  const auto small = [&](const char* name, std::int64_t low, std::int64_t high) -> std::optional<int> {
    const auto value = fields.integer_or_auto(name, low, high);
    return value ? std::optional<int>(static_cast<int>(*value)) : std::nullopt;
  };
  step.order = small("order", 1, kMaxShOrder);
  step.bounces = small("bounces", 0, 64);
  step.samples = small("samples", 1, 65536);
  step.meshless = read_meshless(fields, pointer, errors);
  constexpr PrtStep::Glossy kGlossy[] = {PrtStep::Glossy::automatic, PrtStep::Glossy::on, PrtStep::Glossy::off};
  if (const auto glossy = fields.word("glossy", {"auto", "on", "off"})) step.glossy = kGlossy[*glossy];
  constexpr PrtStep::Merge kMerge[] = {PrtStep::Merge::automatic, PrtStep::Merge::on, PrtStep::Merge::off};
  if (const auto merge = fields.word("merge", {"auto", "on", "off"})) step.merge = kMerge[*merge];
  if (const json* value = fields.find("subdivide"))
    step.subdivide = read_subdivision(*value, pointer + "/subdivide", errors);
  if (const json* value = fields.find("encoding")) step.encoding = read_encoding(*value, pointer + "/encoding", errors);
  return step;
}

RadiosityStep read_radiosity(JsonFields& fields, const std::string& pointer, Errors& errors) {
  RadiosityStep step;
  const auto small = [](JsonFields& from, const char* name, std::int64_t low, std::int64_t high) -> std::optional<int> {
    const auto value = from.integer_or_auto(name, low, high);
    return value ? std::optional<int>(static_cast<int>(*value)) : std::nullopt;
  };
  if (const json* value = fields.find("points")) {
    JsonFields points(*value, pointer + "/points", errors);
    step.radius = points.number_or_auto("radius", 1e-9, 1e12);
    step.levels = small(points, "levels", 1, 12);
    points.finish();
  }
  step.eps_irradiance = fields.number_or_auto("eps_irradiance", 0, 1e6);
  step.rays = small(fields, "rays", 1, 65536);
  step.bounces = small(fields, "bounces", 0, 1000);
  if (const json* value = fields.find("subdivide"))
    step.subdivide = read_subdivision(*value, pointer + "/subdivide", errors);
  return step;
}

RadiosityStep::Deliver read_deliver(const json& list, const std::string& pointer, Errors& errors) {
  RadiosityStep::Deliver out{.vertices = false};
  bool good = list.is_array() && !list.empty();
  for (std::size_t i = 0; good && i < list.size(); ++i) {
    bool* flag = list[i] == "vertices"   ? &out.vertices
                 : list[i] == "lightmap" ? &out.lightmap
                 : list[i] == "points"   ? &out.points
                                         : nullptr;
    good = flag != nullptr && !*flag;
    if (good) *flag = true;
  }
  if (!good)
    errors.push_back({pointer, "must name each form of delivery once", shown(list), "vertices, lightmap, points"});
  return out;
}

/// The step `radiosity` has what `transport` has, and says how the light is delivered.
RadiosityStep read_delivered_radiosity(JsonFields& fields, const std::string& pointer, Errors& errors) {
  RadiosityStep step = read_radiosity(fields, pointer, errors);
  constexpr RadiosityStep::Scheme kSchemes[] = {RadiosityStep::Scheme::rows, RadiosityStep::Scheme::paper};
  if (const auto scheme = fields.word("scheme", {"rows", "paper"})) step.scheme = kSchemes[*scheme];
  step.eps_solid_angle = fields.number_or_auto("eps_solid_angle", 0, kWholeSphere);
  if (step.eps_solid_angle && step.scheme != RadiosityStep::Scheme::paper)
    fields.error("eps_solid_angle", "is a knob of the paper's scheme alone", "scheme: paper");
  if (const json* value = fields.find("deliver")) step.deliver = read_deliver(*value, pointer + "/deliver", errors);
  if (const json* value = fields.find("lightmap")) {
    JsonFields lightmap(*value, pointer + "/lightmap", errors);
    if (const auto size = lightmap.integer_or_auto("size", kLeastLightmap, kMostLightmap))
      step.lightmap_size = static_cast<int>(*size);
    lightmap.finish();
    if (!step.deliver.lightmap) fields.error("lightmap", "means nothing where none is delivered", "deliver: lightmap");
  }
  return step;
}

TransportStep read_transport(JsonFields& fields, const std::string& pointer, Errors& errors) {
  TransportStep step{.surface = read_radiosity(fields, pointer, errors), .sender_level = {}};
  fields.word("scheme", {"rows"});
  if (const auto level = fields.integer_or_auto("sender_level", 0, 11)) step.sender_level = static_cast<int>(*level);
  return step;
}

LightFieldStep::Simplification read_simplification(const json& value, const std::string& pointer, Errors& errors) {
  LightFieldStep::Simplification out;
  if (value.is_string()) {
    out.off = value == "off";
    if (value != "off" && value != "auto")
      errors.push_back({pointer, "must be auto, off or an object", shown(value), "auto, off, object"});
    return out;
  }
  JsonFields fields(value, pointer, errors);
  out.ratio = fields.number("ratio", 1e-6, 1);
  if (const auto n = fields.integer("triangles", 4, kMaxBudget)) out.triangles = static_cast<std::uint64_t>(*n);
  out.max_error = fields.number("max_error", 0, 1);
  constexpr Collapse kCollapses[] = {Collapse::edge, Collapse::half_edge};
  if (const auto collapse = fields.word("collapse", {"edge", "half-edge"})) out.collapse = kCollapses[*collapse];
  out.geometry_weight = fields.number("geometry_weight", 0, 1).value_or(out.geometry_weight);
  fields.finish();
  if (out.ratio && out.triangles)
    fields.error("ratio", "means nothing where triangles are given", "triangles or ratio");
  return out;
}

LightFieldStep read_light_field(JsonFields& fields, const std::string& pointer, Errors& errors) {
  LightFieldStep step;
  if (const auto word = fields.word("basis", {"sh", "polynomial"}); word == 1) step.basis = RadianceBasis::polynomials;
  if (const auto word = fields.word("sky", {"auto", "apart", "series"})) step.sky = static_cast<SkyPart>(*word);
  if (const auto n = fields.integer_or_auto("degree", 0, kMaxLightFieldDegree)) step.degree = static_cast<int>(*n);
  if (const auto n = fields.integer_or_auto("rays", 1, 65536)) step.rays = static_cast<int>(*n);
  if (const auto n = fields.integer_or_auto("bounces", 0, 1000)) step.surface.bounces = static_cast<int>(*n);
  if (const json* value = fields.find("subdivide"))
    step.surface.subdivide = read_subdivision(*value, pointer + "/subdivide", errors);
  if (const json* value = fields.find("simplify"))
    step.simplify = read_simplification(*value, pointer + "/simplify", errors);
  step.lods = static_cast<int>(fields.integer("lods", 0, 8).value_or(0));
  step.progressive = fields.boolean("progressive").value_or(false);
  return step;
}

std::optional<std::array<int, 3>> read_resolution(JsonFields& fields) {
  const json* field = fields.find("resolution");
  if (!field || *field == "auto") return std::nullopt;
  std::array<int, 3> size{};
  bool good = field->is_array() && field->size() == 3;
  for (std::size_t i = 0; good && i < 3; ++i) {
    const json& n = (*field)[i];
    good = n.is_number_integer() && n >= 1 && n <= kMostGridSide;
    if (good) size[i] = n.get<int>();
  }
  if (good) return size;
  fields.error("resolution", "must be auto or three whole numbers from 1 to 512", "auto, [x, y, z]");
  return std::nullopt;
}

GridStep read_grid(JsonFields& fields) {
  GridStep step;
  step.resolution = read_resolution(fields);
  constexpr GridContent kContents[] = {GridContent::indirect, GridContent::all};
  constexpr GridBlend kBlends[] = {GridBlend::exact, GridBlend::paper};
  if (const auto content = fields.word("content", {"indirect", "all"})) step.content = kContents[*content];
  if (const auto blend = fields.word("blend", {"exact", "paper"})) step.blend = kBlends[*blend];
  if (const auto n = fields.integer_or_auto("bounces", 0, 1000)) step.bounces = static_cast<int>(*n);
  if (const auto n = fields.integer_or_auto("samples", 1, 65536)) step.samples = static_cast<int>(*n);
  return step;
}

ReduceStep read_reduce(JsonFields& fields) {
  ReduceStep step;
  if (const auto n = fields.integer_or_auto("triangles", 4, kMaxBudget))
    step.triangles = static_cast<std::uint64_t>(*n);
  step.ratio = fields.number("ratio", 1e-6, 1);
  if (step.triangles && step.ratio)
    fields.error("ratio", "means nothing where triangles are given", "triangles or ratio");
  constexpr ReduceMethod kMethods[] = {ReduceMethod::cluster, ReduceMethod::adaptive};
  if (const auto method = fields.word("method", {"cluster", "adaptive"})) step.method = kMethods[*method];
  const json* map = fields.find("normal_map");
  if (map && *map == "off") {
    step.normal_map = 0;
  } else if (map && *map != "auto") {
    const bool good = map->is_number_integer() && *map >= kLeastMapSide && *map <= kMostMapSide;
    if (good) step.normal_map = map->get<int>();
    if (!good) fields.error("normal_map", "must be auto, off or a whole number from 64 to 8192", "auto, off, texels");
  }
  if (const json* bits = fields.find("normal_bits")) {
    if (*bits == 8 || *bits == 16) step.normal_bits = bits->get<int>();
    if (*bits != 8 && *bits != 16) fields.error("normal_bits", "must be 8 or 16", "8, 16");
    if (*bits == 16 && step.normal_map == 0) fields.error("normal_bits", "means nothing without a normal map", "8");
  }
  return step;
}

/// Reads one step into the recipe. Returns whether it is `reduce`.
bool read_step(const json& value, const std::string& pointer, Recipe& recipe, Errors& errors) {
  JsonFields fields(value, pointer, errors);
  if (!fields.find("do", true)) return false;
  const auto step = fields.word("do", {"prt", "radiosity", "grid", "transport", "reduce", "lightfield"});
  if (!step) return false;
  if (*step == 0) recipe.steps.push_back(read_prt(fields, pointer, errors));
  if (*step == 1) recipe.radiosity = read_delivered_radiosity(fields, pointer, errors);
  if (*step == 2) recipe.grid = read_grid(fields);
  if (*step == 3) recipe.transport = read_transport(fields, pointer, errors);
  if (*step == 4) recipe.reduce = read_reduce(fields);
  if (*step == 5) recipe.light_field = read_light_field(fields, pointer, errors);
  fields.finish();
  return *step == 4;
}

void read_steps(const json& value, Recipe& recipe, Errors& errors) {
  if (!value.is_array() || value.empty() || value.size() > 2) {
    errors.push_back({"/steps", "must be a list with one step, or with reduce and one more", shown(value),
                      "[{\"do\": \"prt\"}], [{\"do\": \"reduce\"}, {\"do\": \"prt\"}]"});
    return;
  }
  const std::size_t before = errors.size();
  const bool first = read_step(value[0], "/steps/0", recipe, errors);
  if (value.size() == 1) return;
  const bool second = read_step(value[1], "/steps/1", recipe, errors);
  if (errors.size() > before) return;
  if (!first || second) {
    errors.push_back({"/steps", "only reduce may come before another step, and once", shown(value),
                      "reduce, then one of prt, radiosity, grid, transport, lightfield"});
  }
}

Promise read_promise(const json& value, Errors& errors) {
  Promise promise;
  JsonFields fields(value, "/quality", errors);
  promise.target_error = fields.number("target_error", 1e-4, 1);
  promise.time_budget_s = fields.number("time_budget_s", 0.01, 30.0 * 86400);
  fields.finish();
  if (value.empty())
    errors.push_back({"/quality", "promises nothing", shown(value), "target_error, time_budget_s, or both"});
  return promise;
}

void read_quality(JsonFields& fields, Recipe& recipe, Errors& errors) {
  constexpr Quality kQualities[] = {Quality::draft, Quality::standard, Quality::finest};
  const json* value = fields.find("quality");
  if (value && value->is_object()) {
    recipe.promise = read_promise(*value, errors);
  } else if (const auto quality = fields.word("quality", {"draft", "standard", "final"})) {
    recipe.quality = kQualities[*quality];
  }
}

void check_field_promise(const Recipe& recipe, Errors& errors) {
  const LightFieldStep& step = *recipe.light_field;
  const PrtStep::Subdivision& split = step.surface.subdivide;
  const bool split_fixed = split.mode == PrtStep::Subdivision::Mode::off || split.triangles;
  const auto& s = step.simplify;
  const bool simplified = s.off || s.ratio || s.triangles || s.max_error;
  const auto& target = recipe.promise.target_error;
  if (step.rays && step.degree && split_fixed && (simplified || !target)) {
    errors.push_back({"/quality", "leaves nothing to spend: degree, rays, triangles and simplification are given", "",
                      "a promise, or all of the knobs"});
  }
  if (s.max_error && target && *s.max_error > *target) {
    errors.push_back({recipe.light_step() + "/simplify/max_error", "is more than /quality/target_error",
                      shown(json(*s.max_error)), "at most " + shown(json(*target))});
  }
}

void check_points_promise(const RadiosityStep& step, const std::string& step_pointer, Errors& errors) {
  const bool split_fixed = step.subdivide.mode == PrtStep::Subdivision::Mode::off || step.subdivide.triangles;
  if (step.rays && step.radius && split_fixed) {
    errors.push_back({"/quality", "leaves nothing to spend: rays, radius of points and triangles of the step are given",
                      "", "a promise, or all three knobs"});
  }
  if (!step.deliver.vertices) {
    errors.push_back({"/quality", "is proven of the light at vertices, which the step does not deliver", "",
                      step_pointer + "/deliver with vertices"});
  }
}

/// A promise is about the certificate, and needs something to spend on.
void check_promise(const Recipe& recipe, Errors& errors) {
  if (!recipe.promise) return;
  if (recipe.radiosity) check_points_promise(*recipe.radiosity, recipe.light_step(), errors);
  if (recipe.transport) check_points_promise(recipe.transport->surface, recipe.light_step(), errors);
  if (recipe.light_field) check_field_promise(recipe, errors);
  if (recipe.reduce && !recipe.bakes_light()) {
    errors.push_back({"/quality", "cannot be promised of a reduce step: triangles are what it is asked for", "",
                      "draft, standard, final"});
  }
  if (!recipe.certificate)
    errors.push_back({"/certificate", "must not be off: what /quality promises is what it proves", "false", "true"});
  if (recipe.grid && recipe.grid->resolution) {
    errors.push_back({"/quality", "leaves nothing to spend: the resolution of the grid is given", "",
                      "a promise, or " + recipe.light_step() + "/resolution"});
  }
  for (const PrtStep& step : recipe.steps) {
    const bool split_fixed = step.subdivide.mode == PrtStep::Subdivision::Mode::off || step.subdivide.triangles;
    if (step.samples && split_fixed) {
      errors.push_back({"/quality", "leaves nothing to spend: samples and triangles of the step are given", "",
                        "a promise, or both knobs"});
    }
  }
  if (recipe.promise.time_budget_s && *recipe.promise.time_budget_s > recipe.limits.wall_s) {
    errors.push_back({"/quality/time_budget_s", "is more than /limits/wall_s allows",
                      shown(json(*recipe.promise.time_budget_s)), "at most " + shown(json(recipe.limits.wall_s))});
  }
}

Limits read_limits(const json& value, Errors& errors) {
  Limits limits;
  JsonFields fields(value, "/limits", errors);
  limits.memory_mb = static_cast<std::uint64_t>(fields.integer("memory_mb", 64, 1 << 20).value_or(4096));
  limits.threads = static_cast<int>(fields.integer("threads", 0, 1024).value_or(0));
  limits.wall_s = fields.number("wall_s", 0.1, 30.0 * 86400).value_or(3600);
  fields.finish();
  return limits;
}

bool is_utf8_text(const std::string& text) {
  try {
    return json(text).dump().size() >= 2 && text.find('\0') == std::string::npos;
  } catch (const json::exception&) {
    return false;
  }
}

Recipe read_recipe(const json& document, Errors& errors) {
  Recipe recipe;
  JsonFields fields(document, "", errors);
  if (const json* scene = fields.find("scene")) {
    JsonFields scene_fields(*scene, "/scene", errors);
    recipe.scene_asset = read_asset(scene_fields);
    scene_fields.finish();
  }
  if (const json* value = fields.find("environment")) recipe.environment = read_environment(*value, errors);
  if (const json* value = fields.find("steps"))
    read_steps(*value, recipe, errors);
  else
    recipe.steps = {PrtStep{}};
  read_quality(fields, recipe, errors);
  recipe.seed = static_cast<std::uint64_t>(fields.integer("seed", 0, kMaxExactInteger).value_or(0));
  if (const json* value = fields.find("limits")) recipe.limits = read_limits(*value, errors);
  recipe.strict = fields.boolean("strict").value_or(false);
  recipe.certificate = fields.boolean("certificate").value_or(true);
  recipe.label = fields.text("label", 200).value_or("");
  if (!is_utf8_text(recipe.label)) fields.error("label", "must be UTF-8 text without NUL", "text");
  fields.finish();
  check_promise(recipe, errors);
  return recipe;
}

}  // namespace

tl::expected<Recipe, std::vector<FieldError>> parse_recipe(std::string_view text) {
  if (text.size() > (1U << 20)) return tl::make_unexpected(Errors{{"", "is larger than 1 MiB", "", ""}});
  const auto depth_guard = [](int depth, json::parse_event_t, json&) { return depth <= 32; };
  const json document = json::parse(text, depth_guard, false);
  if (document.is_discarded()) return tl::make_unexpected(Errors{{"", "is not valid JSON", "", "a JSON object"}});
  Errors errors;
  Recipe recipe = read_recipe(document, errors);
  if (!errors.empty()) return tl::make_unexpected(std::move(errors));
  return recipe;
}

}  // namespace kiln
