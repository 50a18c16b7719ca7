// A recipe as canonical JSON, and the named ones.
#include <nlohmann/json.hpp>

#include "core/bake/recipe.h"

namespace kiln {
namespace {

using nlohmann::json;

json environment_json(const EnvironmentChoice& choice) {
  using Kind = EnvironmentChoice::Kind;
  if (choice.kind == Kind::none) return nullptr;
  json out = {{"rotation_deg", choice.rotation_deg}, {"intensity", choice.intensity}};
  if (choice.kind == Kind::constant) out["constant"] = {choice.constant.x, choice.constant.y, choice.constant.z};
  if (choice.kind == Kind::asset) out["asset"] = choice.name;
  if (choice.kind == Kind::file) out["file"] = choice.name;
  if (choice.kind == Kind::builtin) out["builtin"] = choice.name;
  return out;
}

template <class T>
json or_auto(const std::optional<T>& value) {
  return value ? json(*value) : json("auto");
}

json quality_json(const Recipe& recipe) {
  constexpr const char* kQualities[] = {"draft", "standard", "final"};
  if (!recipe.promise) return kQualities[static_cast<int>(recipe.quality)];
  json out = json::object();
  if (recipe.promise.target_error) out["target_error"] = *recipe.promise.target_error;
  if (recipe.promise.time_budget_s) out["time_budget_s"] = *recipe.promise.time_budget_s;
  return out;
}

json subdivision_json(const PrtStep::Subdivision& s) {
  using Mode = PrtStep::Subdivision::Mode;
  if (s.mode != Mode::on) return s.mode == Mode::off ? "off" : "auto";
  constexpr const char* kNames[] = {"residual", "eq2", "eq3", "eq4"};
  json out = {{"measure", kNames[static_cast<int>(s.measure)]},
              {"alpha", s.alpha},
              {"triangles", or_auto(s.triangles)},
              {"max_depth", s.max_depth}};
  if (s.threshold) out["threshold"] = *s.threshold;
  return out;
}

json encoding_json(const PrtStep::Encoding& e) {
  constexpr const char* kForms[] = {"auto", "raw", "pca"};
  return {{"form", kForms[static_cast<int>(e.form)]}, {"rank", or_auto(e.rank)}, {"bits", or_auto(e.bits)}};
}

/// `glossy`, `merge` and `solver` are left out where they are the default, so that the hash of a recipe older than
/// them, and with it the bytes of a scene without specular parts or needless vertices, are what they were.
json step_json(const PrtStep& step) {
  json out = {{"do", "prt"},
              {"order", or_auto(step.order)},
              {"bounces", or_auto(step.bounces)},
              {"samples", or_auto(step.samples)},
              {"subdivide", subdivision_json(step.subdivide)},
              {"encoding", encoding_json(step.encoding)}};
  if (step.glossy != PrtStep::Glossy::automatic) out["glossy"] = step.glossy == PrtStep::Glossy::on ? "on" : "off";
  if (step.merge != PrtStep::Merge::automatic) out["merge"] = step.merge == PrtStep::Merge::on ? "on" : "off";
  if (step.meshless) {
    out["solver"] = "meshless";
    out["points"] = {{"radius", or_auto(step.meshless->radius)}, {"levels", or_auto(step.meshless->levels)}};
    out["eps_transfer"] = or_auto(step.meshless->eps_transfer);
  }
  return out;
}

/// `deliver` is left out where it is vertices alone, as above.
json step_json(const RadiosityStep& step) {
  json out = {{"do", "radiosity"},
              {"scheme", step.scheme == RadiosityStep::Scheme::paper ? "paper" : "rows"},
              {"points", {{"radius", or_auto(step.radius)}, {"levels", or_auto(step.levels)}}},
              {"eps_irradiance", or_auto(step.eps_irradiance)},
              {"rays", or_auto(step.rays)},
              {"bounces", or_auto(step.bounces)},
              {"subdivide", subdivision_json(step.subdivide)}};
  if (step.scheme == RadiosityStep::Scheme::paper) out["eps_solid_angle"] = or_auto(step.eps_solid_angle);
  const RadiosityStep::Deliver& to = step.deliver;
  if (!to.lightmap && !to.points) return out;
  if (to.vertices) out["deliver"].push_back("vertices");
  if (to.lightmap) out["deliver"].push_back("lightmap");
  if (to.points) out["deliver"].push_back("points");
  if (to.lightmap) out["lightmap"] = {{"size", or_auto(step.lightmap_size)}};
  return out;
}

json step_json(const TransportStep& step) {
  json out = step_json(step.surface);
  out["do"] = "transport";
  out["sender_level"] = or_auto(step.sender_level);
  return out;
}

json simplification_json(const LightFieldStep::Simplification& s) {
  if (s.off) return "off";
  json out = {{"collapse", s.collapse == Collapse::edge ? "edge" : "half-edge"},
              {"geometry_weight", s.geometry_weight}};
  if (s.ratio) out["ratio"] = *s.ratio;
  if (s.triangles) out["triangles"] = *s.triangles;
  if (s.max_error) out["max_error"] = *s.max_error;
  return out;
}

json step_json(const LightFieldStep& step) {
  return {{"do", "lightfield"},
          {"basis", step.basis == RadianceBasis::harmonics ? "sh" : "polynomial"},
          {"sky", std::array{"auto", "apart", "series"}[static_cast<std::size_t>(step.sky)]},
          {"degree", or_auto(step.degree)},
          {"rays", or_auto(step.rays)},
          {"bounces", or_auto(step.surface.bounces)},
          {"subdivide", subdivision_json(step.surface.subdivide)},
          {"simplify", simplification_json(step.simplify)},
          {"lods", step.lods},
          {"progressive", step.progressive}};
}

json step_json(const GridStep& step) {
  json out = {{"do", "grid"},
              {"resolution", "auto"},
              {"content", step.content == GridContent::all ? "all" : "indirect"},
              {"blend", step.blend == GridBlend::paper ? "paper" : "exact"},
              {"bounces", or_auto(step.bounces)},
              {"samples", or_auto(step.samples)}};
  if (step.resolution) out["resolution"] = *step.resolution;
  return out;
}

json step_json(const ReduceStep& step) {
  json out = {{"do", "reduce"},
              {"method", step.method == ReduceMethod::cluster ? "cluster" : "adaptive"},
              {"normal_map", or_auto(step.normal_map)}};
  if (step.normal_map && *step.normal_map == 0) out["normal_map"] = "off";
  if (step.normal_bits != 8) out["normal_bits"] = step.normal_bits;
  if (step.ratio) out["ratio"] = *step.ratio;
  if (!step.ratio) out["triangles"] = or_auto(step.triangles);
  return out;
}

}  // namespace

std::string recipe_identity(const Recipe& recipe) {
  json out = json::parse(recipe_json(recipe));
  for (const char* field : {"label", "limits", "scene"}) out.erase(field);
  return out.dump();
}

std::string recipe_json(const Recipe& recipe) {
  json out = {
      {"quality", quality_json(recipe)},
      {"seed", recipe.seed},
      {"limits",
       {{"memory_mb", recipe.limits.memory_mb}, {"threads", recipe.limits.threads}, {"wall_s", recipe.limits.wall_s}}},
      {"strict", recipe.strict},
      {"certificate", recipe.certificate},
      {"label", recipe.label},
      {"steps", json::array()}};
  if (recipe.reduce) out["steps"].push_back(step_json(*recipe.reduce));
  for (const PrtStep& step : recipe.steps) out["steps"].push_back(step_json(step));
  if (recipe.radiosity) out["steps"].push_back(step_json(*recipe.radiosity));
  if (recipe.grid) out["steps"].push_back(step_json(*recipe.grid));
  if (recipe.transport) out["steps"].push_back(step_json(*recipe.transport));
  if (recipe.light_field) out["steps"].push_back(step_json(*recipe.light_field));
  if (!recipe.scene_asset.empty()) out["scene"] = {{"asset", recipe.scene_asset}};
  if (const json environment = environment_json(recipe.environment); !environment.is_null())
    out["environment"] = environment;
  return out.dump();
}

const std::vector<Preset>& presets() {
  static const std::vector<Preset> all = {
      {"prt", "Relightable diffuse light, adaptive, under a clear sky with sun",
       R"({"steps":[{"do":"prt"}],"environment":{"builtin":"clear"}})"},
      {"prt-draft", "The same, coarse and quick",
       R"({"steps":[{"do":"prt"}],"environment":{"builtin":"clear"},"quality":"draft"})"},
      {"prt-final", "The same, for delivery",
       R"({"steps":[{"do":"prt"}],"environment":{"builtin":"clear"},"quality":"final"})"},
      {"glossy", "The same with what every surface mirrors, by transfer matrices at its vertices",
       R"({"steps":[{"do":"prt","glossy":"on"}],"environment":{"builtin":"clear"}})"},
      {"overcast", "Relightable diffuse light under an overcast sky",
       R"({"steps":[{"do":"prt"}],"environment":{"builtin":"overcast"}})"},
      {"radiosity", "Light of one job, all reflections, under a clear sky with sun: not relightable, small and quick",
       R"({"steps":[{"do":"radiosity"}],"environment":{"builtin":"clear"}})"},
      {"grid", "Indirect light in a grid, for what moves in the scene; the scene itself lit as by radiosity",
       R"({"steps":[{"do":"grid"}],"environment":{"builtin":"clear"}})"},
      {"transport", "Reflected light of lights that move after the bake; the scene itself lit as by radiosity",
       R"({"steps":[{"do":"transport"}],"environment":{"builtin":"clear"}})"},
      {"lightfield", "Radiance towards every eye under a courtyard's light: highlights move with the eye",
       R"({"steps":[{"do":"lightfield"}],"environment":{"builtin":"courtyard"}})"},
      {"reduce", "A scan of any size down to a tenth, at most 200,000 triangles, with a normal map",
       R"({"steps":[{"do":"reduce"}]})"},
      {"lamps", "Only the scene's own emitters and lights", R"({"steps":[{"do":"prt"}]})"},
  };
  return all;
}

}  // namespace kiln
