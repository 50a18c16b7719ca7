#include "core/bake/report.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/bake/bake.h"

namespace kiln {
namespace {

using nlohmann::ordered_json;

ordered_json plan_list(const Plan& plan) {
  ordered_json list = ordered_json::array();
  for (const Decision& d : plan.decisions)
    list.push_back({{"decision", d.decision}, {"value", d.value}, {"reason", d.reason}});
  return list;
}

ordered_json warning_list(const Scene& scene) {
  ordered_json list = ordered_json::array();
  for (const Warning& w : scene.warnings)
    list.push_back({{"code", w.code}, {"message", w.message}, {"where", w.where}});
  return list;
}

ordered_json scene_object(const ReportInput& in) {
  return {{"triangles", in.input_triangles},      {"vertices", in.input_vertices},
          {"parts", in.input.parts.size()},       {"materials", in.input.materials.size()},
          {"textures", in.input.textures.size()}, {"lights", in.input.lights.size()},
          {"world_size", in.input.frame.scale}};
}

ordered_json stage_list(const BakeLog& log) {
  ordered_json list = ordered_json::array();
  for (const StageRecord& s : log.stages())
    list.push_back({{"name", s.name}, {"seconds", s.seconds}, {"rays", s.rays}});
  return list;
}

ordered_json result_object(const ReportInput& in) {
  const auto vertices = std::max<std::uint64_t>(in.result.position.size(), 1);
  ordered_json streams = ordered_json::array();
  for (const auto& [name, bytes] : in.streams) streams.push_back({{"name", name}, {"bytes", bytes}});
  return {{"triangles", in.result.triangles.size()},
          {"vertices", in.result.position.size()},
          {"bytes", in.result_bytes},
          {"bytes_per_vertex", static_cast<double>(in.result_bytes) / static_cast<double>(vertices)},
          {"form", in.rank > 0 ? "pca" : "raw"},
          {"rank", in.rank},
          {"streams", streams}};
}

ordered_json error_object(const ErrorStats& e) {
  return {{"relrmse", e.relrmse},
          {"interval", {e.interval_low, e.interval_high}},
          {"relrmse_without_worst_1pct", e.relrmse_without_worst_1pct},
          {"p99", e.p99},
          {"max", e.max},
          {"bias", e.bias},
          {"reference_noise", e.noise}};
}

ordered_json certificate_object(const std::optional<Certificate>& certificate) {
  if (!certificate) return nullptr;
  ordered_json out = error_object(certificate->transport);
  out["points"] = certificate->points;
  out["samples"] = certificate->samples;
  out["lightings"] = ordered_json::array();
  for (std::size_t i = 0; i < certificate->lightings.size() && i < certificate->transport.by_lighting.size(); ++i) {
    out["lightings"].push_back(
        {{"name", certificate->lightings[i]}, {"relrmse", certificate->transport.by_lighting[i]}});
  }
  out["dark"] = certificate->dark;
  if (certificate->seen) {
    out["seen"] = error_object(*certificate->seen);
    out["seen"]["points"] = certificate->seen->points;
  }
  if (certificate->job_light) out["job_light"] = error_object(*certificate->job_light);
  out["seconds"] = certificate->seconds;
  return out;
}

ordered_json grid_certificate_object(const std::optional<GridCertificate>& certificate) {
  if (!certificate) return nullptr;
  ordered_json out = error_object(certificate->error);
  out["points"] = certificate->points;
  out["samples"] = certificate->samples;
  out["mean_light"] = certificate->mean_light;
  out["dark"] = certificate->dark;
  const GridSources& s = certificate->sources;
  out["sources"] = {{"noise", s.noise}, {"storage", s.storage}, {"lattice", s.lattice}};
  out["seconds"] = certificate->seconds;
  return out;
}

ordered_json grid_pass_list(const GridOutcome& grid) {
  ordered_json list = ordered_json::array();
  for (const GridPass& p : grid.passes) {
    list.push_back({{"size", p.size},
                    {"rays", p.rays},
                    {"seconds", p.seconds},
                    {"relrmse", p.relrmse},
                    {"interval", {p.low, p.high}}});
  }
  return list;
}

ordered_json grid_object(const GridOutcome& grid, const GridBake& params) {
  return {{"size", grid.size},
          {"spacing", {grid.spacing.x, grid.spacing.y, grid.spacing.z}},
          {"blend", params.blend == GridBlend::exact ? "exact" : "paper"},
          {"content", params.content == GridContent::indirect ? "indirect" : "all"},
          {"rays_per_vertex", grid.rays},
          {"rays", grid.stats.rays},
          {"invalid_vertices", grid.stats.invalid},
          {"moved_vertices", grid.stats.moved},
          {"bytes", grid.file.size()},
          {"passes", grid_pass_list(grid)},
          {"certificate", grid_certificate_object(grid.certificate)}};
}

ordered_json grid_promise(const Promise& promise, const GridOutcome& grid) {
  ordered_json out;
  if (promise.target_error) out["target_error"] = *promise.target_error;
  if (promise.time_budget_s) out["time_budget_s"] = *promise.time_budget_s;
  out["kept"] = grid.kept;
  out["ended_by"] = grid.ended_by;
  out["reason"] = grid.reason;
  out["passes"] = grid_pass_list(grid);
  return out;
}

ordered_json links_sources(const LinkSources& s) {
  return {{"noise", s.noise}, {"links", s.links}, {"senders", s.senders}, {"interpolation", s.interpolation}};
}

ordered_json links_certificate_object(const std::optional<LinksCertificate>& certificate) {
  if (!certificate) return nullptr;
  ordered_json out = error_object(certificate->error);
  const ErrorStats& rms = certificate->of_rms;
  out["of_rms"] = rms.relrmse;
  out["of_rms_interval"] = {rms.interval_low, rms.interval_high};
  out["sources"] = links_sources(certificate->sources);
  out["lamps"] = ordered_json::array();
  for (std::size_t k = 0; k < certificate->lamps.size(); ++k) {
    const Vec3d& at = certificate->lamps[k];
    out["lamps"].push_back(
        {{"place", {at.x, at.y, at.z}},
         {"relrmse", k < certificate->error.by_lighting.size() ? certificate->error.by_lighting[k] : 0},
         {"of_rms", k < rms.by_lighting.size() ? rms.by_lighting[k] : 0},
         {"mean_light", certificate->mean_light[k]}});
  }
  out["dark"] = certificate->dark;
  out["points"] = certificate->points;
  out["samples"] = certificate->samples;
  out["rays"] = certificate->rays;
  out["seconds"] = certificate->seconds;
  return out;
}

ordered_json links_object(const LinksOutcome& links) {
  return {{"senders", links.links.senders},
          {"sender_level", links.stats.sender_level},
          {"receivers", links.links.rows() - links.links.senders},
          {"alone", links.stats.alone},
          {"nodes", links.links.nodes()},
          {"links", links.links.links.size()},
          {"share_of_possible", links.links.share_of_possible()},
          {"sweeps", links.links.sweeps},
          {"tail", links.links.tail},
          {"left_after_sweeps", links.stats.left},
          {"rays", links.stats.rays},
          {"bytes", links.bytes},
          {"certificate", links_certificate_object(links.certificate)}};
}

ordered_json lightmap_object(const LightmapOutcome& map) {
  ordered_json certificate;
  if (map.certificate) {
    const LightmapCertificate& c = *map.certificate;
    certificate = error_object(c.error);
    certificate["image"] = error_object(c.image);
    certificate["points"] = c.points;
    certificate["samples"] = c.samples;
    certificate["mean_light"] = c.mean_light;
    certificate["dark"] = c.dark;
    certificate["rays"] = c.rays;
    certificate["seconds"] = c.seconds;
  }
  return {{"size", map.lightmap.side},
          {"texels", map.texels},
          {"hidden_texels", map.hidden},
          {"seam_places", map.seam_places},
          {"texels_per_metre", map.texels_per_metre},
          {"image_bytes", map.image_bytes},
          {"exr_bytes", map.exr.size()},
          {"certificate", certificate}};
}

ordered_json field_certificate_object(const std::optional<FieldCertificate>& certificate) {
  if (!certificate) return nullptr;
  ordered_json out = error_object(certificate->radiance);
  out["points"] = certificate->points;
  out["samples"] = certificate->samples;
  out["seconds"] = certificate->seconds;
  return out;
}

ordered_json field_object(const FieldOutcome& f) {
  ordered_json levels = ordered_json::array();
  for (const FieldLevelReport& level : f.levels) {
    levels.push_back({{"file", level.file},
                      {"triangles", level.triangles},
                      {"vertices", level.vertices},
                      {"bytes", level.bytes},
                      {"simplification", level.estimate},
                      {"reached", level.reached},
                      {"screen_pixels", level.follows ? ordered_json(level.follows->pixels) : ordered_json()},
                      {"screen_difference", level.follows ? ordered_json(level.follows->difference) : ordered_json()},
                      {"certificate", field_certificate_object(level.certificate)}});
  }
  return {{"degree", f.degree},
          {"truth", f.carried ? "the light field of the input" : "paths under the light of the job"},
          {"noise", f.noise},
          {"rank", f.rank},
          {"baked_triangles", f.baked_triangles},
          {"baked_vertices", f.baked_vertices},
          {"progressive_bytes", f.progressive_bytes},
          {"certificate", f.levels.empty() ? nullptr : field_certificate_object(f.levels.front().certificate)},
          {"levels", levels}};
}

ordered_json glossy_object(const GlossyReport& g) {
  ordered_json out = {{"order", g.order}, {"channels", g.channels},       {"vertices", g.vertices},
                      {"rank", g.rank},   {"compression", g.compression}, {"noise", g.noise}};
  if (!g.certificate) return out;
  const GlossyCertificate& c = *g.certificate;
  out["radiance"] = error_object(c.radiance);
  for (std::size_t i = 0; i < c.lightings.size() && i < c.radiance.by_lighting.size(); ++i)
    out["radiance"]["lightings"].push_back({{"name", c.lightings[i]}, {"relrmse", c.radiance.by_lighting[i]}});
  out["specular"] = error_object(c.specular);
  out["transport"] = error_object(c.transport);
  out["truncation"] = error_object(c.truncation);
  if (c.job_light) out["job_light"] = error_object(*c.job_light);
  out["dark"] = c.dark;
  out["points"] = c.points;
  out["samples"] = c.samples;
  out["seconds"] = c.seconds;
  return out;
}

ordered_json seconds_object(const StageClock& clock) {
  ordered_json out = ordered_json::object();
  for (const auto& [name, seconds] : clock.seconds()) out[name] = seconds;
  return out;
}

ordered_json meshless_object(const MeshlessOutcome& m) {
  ordered_json out = ordered_json::object();
  if (m.sweeps) {
    out["reflections"] = {{"levels", m.sweeps->points.size()},       {"points", m.sweeps->points},
                          {"gathered", m.sweeps->gathered},          {"alone", m.sweeps->alone},
                          {"direct_rays", m.sweeps->direct_rays},    {"gather_rays", m.sweeps->gather_rays},
                          {"seconds", seconds_object(m.sweep_clock)}};
  }
  if (m.matrices) {
    out["matrices"] = {{"levels", m.matrices->points.size()},
                       {"points", m.matrices->points},
                       {"computed", m.matrices->computed},
                       {"alone", m.matrices->alone},
                       {"all", m.matrices->matrices()},
                       {"vertices", m.matrix_vertices},
                       {"norm_of_noise", m.matrices->noise},
                       {"rays", m.matrix_rays},
                       {"seconds", seconds_object(m.matrix_clock)}};
  }
  return out;
}

ordered_json merge_object(const MergeOutcome& m) {
  return {{"input_triangles", m.input_triangles},
          {"input_vertices", m.input_vertices},
          {"triangles", m.triangles},
          {"vertices", m.vertices},
          {"error", m.error},
          {"distance_rms", m.distance_rms},
          {"distance_max", m.distance_max}};
}

ordered_json radiosity_parameters(const Plan& plan) {
  const Radiosity& r = *plan.radiosity;
  ordered_json out = {{"scheme", r.paper ? "paper" : "rows"},
                      {"radius_unit_cube", r.points.radius},
                      {"levels", r.points.levels},
                      {"rays", r.rays},
                      {"eps_irradiance", r.eps},
                      {"bounces", r.bounces < 0 ? ordered_json("auto") : ordered_json(r.bounces)},
                      {"lamp_rays", {r.direct.lamps.few, r.direct.lamps.many}},
                      {"sky_rays", r.direct.sky},
                      {"triangles", plan.subdivide.triangles},
                      {"threshold", plan.subdivide.threshold}};
  if (r.paper) out["eps_solid_angle"] = *r.paper;
  return out;
}

ordered_json field_parameters(const FieldPlan& field) {
  ordered_json out = {{"basis", field.basis == RadianceBasis::harmonics ? "sh" : "polynomial"},
                      {"degree", field.outgoing.degree}};
  if (!field.carried) out["rays"] = field.outgoing.rays;
  out["storage"] = field.storage;
  return out;
}

ordered_json parameters_object(const Plan& plan) {
  if (plan.field && plan.field->carried) return {{"lightfield", field_parameters(*plan.field)}};
  if (plan.radiosity) {
    ordered_json out = radiosity_parameters(plan);
    if (plan.links) {
      const LinkParams& l = *plan.links;
      out["links"] = {{"rays", l.rays},
                      {"eps", l.eps},
                      {"split", l.oracle.split},
                      {"largest", l.oracle.largest},
                      {"sender_level", l.sender_level < 0 ? ordered_json("auto") : ordered_json(l.sender_level)}};
    }
    if (plan.field) out["lightfield"] = field_parameters(*plan.field);
    if (plan.grid) out["grid"] = {{"size", plan.grid->size}, {"rays_per_vertex", plan.grid->rays}};
    return out;
  }
  constexpr const char* kMeasures[] = {"residual", "eq2", "eq3", "eq4"};
  ordered_json out = {{"order", plan.order},
                      {"bounces", plan.bounces},
                      {"samples", plan.samples},
                      {"noise", plan.noise},
                      {"bounce_samples", plan.bounce_samples},
                      {"lamp_samples", plan.lamp_samples},
                      {"triangles", plan.subdivide.triangles},
                      {"measure", kMeasures[static_cast<int>(plan.subdivide.measure)]},
                      {"threshold", plan.subdivide.threshold},
                      {"max_depth", plan.subdivide.max_depth},
                      {"compression", plan.compression},
                      {"merge_error", plan.merge ? plan.merge->max_error : 0},
                      {"merge_reach", plan.merge ? plan.merge->max_reach : 0},
                      {"glossy_order", plan.glossy.order},
                      {"glossy_samples", plan.glossy ? plan.glossy.samples : 0},
                      {"glossy_compression", plan.glossy ? plan.glossy.compression : 0}};
  if (plan.meshless) out["meshless"] = {{"eps", plan.meshless->eps}, {"eps_transfer", plan.meshless->eps_transfer}};
  return out;
}

ordered_json prediction_object(const Prediction& p) {
  return {{"triangles", p.triangles}, {"vertices", p.vertices},         {"rays", p.rays},
          {"seconds", p.seconds},     {"memory_bytes", p.memory_bytes}, {"artifact_bytes", p.artifact_bytes}};
}

ordered_json sources_object(const ErrorSources& s, const Plan& plan) {
  ordered_json out = {{"noise", s.noise},
                      {"noise_of_reflections", s.noise_of_reflections},
                      {"interpolation", s.interpolation},
                      {"bounce_tail", s.bounce_tail},
                      {"quantisation", s.quantisation},
                      {"merging", s.merging},
                      {"compression", s.compression}};
  if (plan.radiosity) out["points"] = s.points;
  if (s.truncation) out["truncation"] = *s.truncation;
  return out;
}

ordered_json pass_list(const Passes& passes, const Plan& plan) {
  ordered_json list = ordered_json::array();
  for (const PassRecord& p : passes.all()) {
    list.push_back({{"order", p.order},
                    {"samples", p.samples},
                    {"bounce_samples", p.bounce_samples},
                    {"bounces", p.bounces},
                    {"triangles", p.triangles},
                    {"vertices", p.vertices},
                    {"rays", p.rays},
                    {"seconds", p.seconds},
                    {"relrmse", p.relrmse},
                    {"interval", {p.low, p.high}},
                    {"sources", sources_object(p.sources, plan)}});
    if (!plan.radiosity) continue;
    list.back()["points"] = p.points;
    list.back()["gathered"] = p.gathered;
  }
  return list;
}

ordered_json field_pass_list(const Passes& passes) {
  ordered_json list = ordered_json::array();
  for (const PassRecord& p : passes.all()) {
    const ErrorSources& s = p.sources;
    list.push_back({{"degree", p.order},
                    {"rays_of_a_vertex", p.samples},
                    {"baked_triangles", p.triangles},
                    {"baked_vertices", p.vertices},
                    {"rays", p.rays},
                    {"seconds", p.seconds},
                    {"relrmse", p.relrmse},
                    {"interval", {p.low, p.high}},
                    {"sources",
                     {{"noise", s.noise},
                      {"places_and_bands", s.interpolation},
                      {"last_band", s.truncation.value_or(0)},
                      {"simplification", s.merging},
                      {"storage", s.compression}}}});
  }
  return list;
}

ordered_json links_pass_list(const Passes& passes) {
  ordered_json list = ordered_json::array();
  for (const PassRecord& p : passes.all()) {
    const ErrorSources& s = p.sources;
    list.push_back(
        {{"rays_of_a_row", p.bounce_samples},
         {"senders", p.points},
         {"receivers", p.gathered},
         {"triangles", p.triangles},
         {"vertices", p.vertices},
         {"rays", p.rays},
         {"seconds", p.seconds},
         {"of_rms", p.relrmse},
         {"interval", {p.low, p.high}},
         {"sources", {{"noise", s.noise}, {"senders_and_links", s.points}, {"interpolation", s.interpolation}}}});
  }
  return list;
}

const char* name_of(Outlook::Ending ending) {
  constexpr const char* kEndings[] = {"target_met", "time_spent", "floor"};
  return kEndings[static_cast<int>(ending)];
}

ordered_json promise_object(const ReportInput& in) {
  const Promise& promise = in.recipe.promise;
  const Passes& passes = in.passes;
  ordered_json out;
  if (promise.target_error) out["target_error"] = *promise.target_error;
  if (promise.time_budget_s) out["time_budget_s"] = *promise.time_budget_s;
  out["kept"] = passes.kept();
  out["ended_by"] = name_of(passes.outlook().ending);
  out["reason"] = passes.outlook().reason;
  out["passes"] = in.field ? field_pass_list(passes) : in.links ? links_pass_list(passes) : pass_list(passes, in.plan);
  return out;
}

std::string text_of(const ordered_json& json) {
  return json.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace

std::string report_json(const ReportInput& in) {
  ordered_json out = {{"engine", std::string("kiln ") + kEngineVersion},
                      {"scene", scene_object(in)},
                      {"plan", plan_list(in.plan)},
                      {"parameters", parameters_object(in.plan)},
                      {"prediction", prediction_object(in.plan.prediction)},
                      {"recipe", ordered_json::parse(recipe_json(in.recipe))},
                      {"stages", stage_list(in.log)},
                      {"seconds", in.log.seconds()},
                      {"rays", in.log.rays()},
                      {"peak_memory_bytes", peak_memory_bytes()},
                      {"result", result_object(in)},
                      {"warnings", warning_list(in.input)},
                      {"certificate", certificate_object(in.certificate)}};
  if (in.merge) out["merge"] = merge_object(*in.merge);
  if (in.sources) out["error_sources"] = sources_object(*in.sources, in.plan);
  if (in.grid) out["grid"] = grid_object(*in.grid, *in.plan.grid);
  if (in.links) out["links"] = links_object(*in.links);
  if (in.lightmap) out["lightmap"] = lightmap_object(*in.lightmap);
  if (in.points) out["points"] = {{"levels", in.points->levels}, {"bytes", in.points->bytes}};
  if (in.recipe.promise) out["promise"] = in.grid ? grid_promise(in.recipe.promise, *in.grid) : promise_object(in);
  if (in.field) out["lightfield"] = field_object(*in.field);
  if (in.glossy) out["glossy"] = glossy_object(*in.glossy);
  if (in.meshless) out["meshless"] = meshless_object(*in.meshless);
  return text_of(out);
}

std::string plan_report_json(const Plan& plan, const Scene& scene, const Promise& promise,
                             const std::optional<Ahead>& ahead) {
  ordered_json prediction = prediction_object(ahead ? ahead->plan.prediction : plan.prediction);
  prediction["of"] = ahead                   ? "the promise"
                     : promise.time_budget_s ? "the time budget"
                     : promise               ? "the first pass"
                                             : "the bake";
  if (ahead) {
    prediction["seconds"] = ahead->seconds;
    prediction["rays"] = ahead->rays;
    prediction["passes"] = ahead->passes;
    prediction["relrmse"] = ahead->relrmse;
    prediction["ended_by"] = name_of(ahead->outlook.ending);
    prediction["reason"] = ahead->outlook.reason;
  } else if (promise.time_budget_s) {  // one pass there is in any case
    prediction["seconds"] = std::max(*promise.time_budget_s, plan.prediction.seconds);
  }
  return text_of({{"plan", plan_list(plan)},
                  {"parameters", parameters_object(plan)},
                  {"prediction", prediction},
                  {"warnings", warning_list(scene)}});
}

}  // namespace kiln
