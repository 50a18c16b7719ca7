#include "core/bake/reduce_step.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "core/artifact/gltf_container.h"
#include "core/artifact/reduced_glb.h"
#include "core/artifact/triangle_stream.h"
#include "core/bake/bake_log.h"
#include "core/bake/job_light.h"
#include "core/bake/preview.h"
#include "core/bake/provenance.h"
#include "core/reduce/measure.h"
#include "core/reduce/reduce.h"

namespace kiln {
namespace {

using nlohmann::ordered_json;

constexpr std::uint64_t kMostByDefault = 200'000;
constexpr double kShareByDefault = 0.1;

// What a preview holds at most, and takes on two cores: measured on results of 8000 to a million triangles.
constexpr std::uint64_t kPreviewBytes = 40 << 20, kPreviewBytesPerTriangle = 800, kPreviewBytesPerTexel = 10;
constexpr double kPreviewSeconds = 1;

struct Decision {
  std::string decision, value, reason;
};

/// Everything that is known before the first triangle is read.
struct Prepared {
  TriangleSource source;
  Reduce params;
  ReducePlan plan;
  std::uint64_t preview_bytes = 0;  // 0: no preview
  std::vector<Decision> decisions;
  std::vector<Warning> warnings;
};

std::uint64_t target_of(const ReduceStep& step, std::uint64_t triangles) {
  if (step.triangles) return *step.triangles;
  const double share = step.ratio.value_or(kShareByDefault) * static_cast<double>(triangles);
  const auto target = std::max<std::uint64_t>(4, static_cast<std::uint64_t>(std::llround(share)));
  return step.ratio ? target : std::min(target, kMostByDefault);
}

void decide(Prepared& p, const ReduceStep& step) {
  const std::string asked = "asked for by the recipe";
  p.decisions.push_back({"triangles", std::to_string(p.params.triangles),
                         step.triangles || step.ratio ? asked : "a tenth of the model's, at most 200000"});
  if (p.plan.unchanged) {
    p.decisions.push_back(
        {"reduction", "none",
         "the model has " + std::to_string(p.source.triangles) + " triangles: it comes back as it is"});
    return;
  }
  if (p.plan.in_core) {
    p.decisions.push_back(
        {"method", "collapse", "the whole model fits into limits.memory_mb: edges are collapsed at once"});
  } else {
    const bool adaptive = p.params.method == ReduceMethod::adaptive;
    p.decisions.push_back(
        {"method", adaptive ? "adaptive" : "cluster",
         "the model would take more than limits.memory_mb: " + std::to_string(p.plan.cells) +
             " cells are filled as it passes by" +
             (adaptive ? ", joined to " + std::to_string(p.plan.vertices) + " where it is flat" : "") +
             ", then edges are collapsed"});
  }
  p.decisions.push_back({"normal map", p.plan.map_side > 0 ? std::to_string(p.plan.map_side) : "off",
                         step.normal_map ? asked : "eight texels a triangle of the model, as the memory allows"});
}

/// A preview traces the result, which must fit into memory for that: a reduction alone holds less.
void decide_preview(Prepared& p, const BakeInput& input) {
  if (input.recipe.bakes_light()) return;  // that bake makes one
  const std::uint64_t triangles = std::min(p.params.triangles, p.source.triangles);
  const auto side = static_cast<std::uint64_t>(p.plan.map_side);
  const std::uint64_t needed =
      kPreviewBytes + kPreviewBytesPerTriangle * triangles + kPreviewBytesPerTexel * side * side;
  if (needed > p.params.memory_bytes) {
    p.decisions.push_back({"preview", "none",
                           "to trace a picture of " + std::to_string(triangles) + " triangles takes " +
                               std::to_string((needed >> 20) + 1) + " MB, more than limits.memory_mb"});
    return;
  }
  p.preview_bytes = needed;
  const bool own = input.recipe.environment.kind != EnvironmentChoice::Kind::none;
  p.decisions.push_back(
      {"preview", "path traced", own ? "under the environment of the recipe" : "under an overcast sky"});
}

Result<Prepared> prepare(const BakeInput& input) {
  const ReduceStep& step = *input.recipe.reduce;
  Prepared p;
  Findings findings(input.scene.name);
  const std::uint64_t memory = input.recipe.limits.memory_mb << 20;
  p.source = open_triangles(input.scene, {.spill_folder = input.spill_folder, .max_memory_bytes = memory}, findings);
  if (findings.failed()) return tl::make_unexpected(findings.fault());
  p.warnings = findings.warnings();
  if (input.recipe.environment.kind != EnvironmentChoice::Kind::none && !input.recipe.bakes_light())
    p.warnings.push_back(
        {"environment_unused", "A reduction needs no light: the environment lights preview.png and nothing else.", ""});
  if (input.recipe.strict && !p.warnings.empty()) {
    const Warning& first = p.warnings.front();
    return fault("strict_" + first.code, "strict: " + first.message, first.where);
  }
  p.params = {.triangles = target_of(step, p.source.triangles),
              .method = step.method,
              .map_side = step.normal_map.value_or(-1),
              .normal_bits = step.normal_bits,
              .memory_bytes = memory,
              .seed = input.recipe.seed};
  KILN_TRY(plan, plan_reduction(p.source, p.params));
  p.plan = plan;
  decide(p, step);
  decide_preview(p, input);
  if (input.recipe.bakes_light())
    p.decisions.push_back({"light", "afterwards", "its bake is planned when the reduced scene is there"});
  return p;
}

ordered_json decision_list(const Prepared& p) {
  ordered_json list = ordered_json::array();
  for (const Decision& d : p.decisions)
    list.push_back({{"decision", d.decision}, {"value", d.value}, {"reason", d.reason}});
  return list;
}

ordered_json warning_list(const Prepared& p) {
  ordered_json list = ordered_json::array();
  for (const Warning& w : p.warnings) list.push_back({{"code", w.code}, {"message", w.message}, {"where", w.where}});
  return list;
}

ordered_json prediction_object(const Prepared& p) {
  const std::uint64_t triangles = std::min(p.params.triangles, p.source.triangles);
  const auto texels = static_cast<std::uint64_t>(p.plan.map_side) * static_cast<std::uint64_t>(p.plan.map_side);
  return {{"triangles", triangles},
          {"vertices", triangles / 2},
          {"rays", 0},
          {"seconds", p.plan.seconds + (p.preview_bytes > 0 ? kPreviewSeconds : 0)},
          {"memory_bytes", std::max(p.plan.memory_bytes, p.preview_bytes)},
          {"artifact_bytes", 60 * triangles + (p.params.normal_bits == 16 ? 5 : 2) * texels}};
}

ordered_json parameters_object(const Prepared& p) {
  return {{"triangles", p.params.triangles},
          {"method", p.params.method == ReduceMethod::adaptive ? "adaptive" : "cluster"},
          {"in_core", p.plan.in_core},
          {"cells", p.plan.cells},
          {"clustered_vertices", p.plan.vertices},
          {"normal_map", p.plan.map_side},
          {"normal_bits", p.params.normal_bits}};
}

ordered_json error_object(const Reduced& r) {
  const GeometricError& e = r.error;
  return {{"unit", "of the diagonal of the model's box"},
          {"rms", e.rms},
          {"max", e.most},
          {"rms_back", e.rms_back},
          {"max_back", e.most_back},
          {"points", e.points},
          {"points_back", e.points_back},
          {"points_back_beyond_reach", e.beyond}};
}

std::string text_of(const ordered_json& json) {
  return json.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

ordered_json report_head(const BakeInput& input, const Prepared& p, const BakeLog& log) {
  ordered_json stages = ordered_json::array();
  for (const StageRecord& s : log.stages()) stages.push_back({{"name", s.name}, {"seconds", s.seconds}, {"rays", 0}});
  return {{"engine", std::string("kiln ") + kEngineVersion},
          {"scene", {{"triangles", p.source.triangles}, {"vertices", p.source.vertices}, {"bytes", p.source.bytes}}},
          {"plan", decision_list(p)},
          {"parameters", parameters_object(p)},
          {"prediction", prediction_object(p)},
          {"recipe", ordered_json::parse(recipe_json(input.recipe))},
          {"stages", stages},
          {"seconds", log.seconds()},
          {"rays", 0},
          {"peak_memory_bytes", peak_memory_bytes()},
          {"warnings", warning_list(p)},
          {"certificate", nullptr}};
}

std::string log_text(const Prepared& p, const BakeLog& log) {
  std::string text = std::string("kiln ") + kEngineVersion + "\n";
  for (const Decision& d : p.decisions) text += "plan   " + d.decision + " = " + d.value + ": " + d.reason + "\n";
  for (const Warning& w : p.warnings)
    text += "warn   " + w.code + ": " + w.message + (w.where.empty() ? "" : " (" + w.where + ")") + "\n";
  for (const StageRecord& s : log.stages()) text += "stage  " + s.name + ": " + std::to_string(s.seconds) + " s\n";
  return text;
}

BakeOutput output_of(Bytes glb, Bytes preview, const std::string& report, const std::string& log) {
  BakeOutput output;
  output.files.push_back({"scene.glb", "model/gltf-binary", std::move(glb)});
  if (!preview.empty()) output.files.push_back({"preview.png", "image/png", std::move(preview)});
  output.files.push_back({"report.json", "application/json", Bytes(report.begin(), report.end())});
  output.files.push_back({"log.txt", "text/plain; charset=utf-8", Bytes(log.begin(), log.end())});
  return output;
}

std::string stem_of(const std::string& name) {
  const std::string stem = std::filesystem::path(name).stem().string();
  return stem.empty() ? "model" : stem;
}

/// The pixels of a reduced model's normal map, which an import leaves alone.
void put_normal_map(Scene& scene, const SurfaceMaps& maps) {
  if (maps.side == 0) return;
  const int texture = scene.materials.front().normal_texture.texture;
  Image& image = scene.images[static_cast<std::size_t>(scene.textures[static_cast<std::size_t>(texture)].image)];
  image.width = image.height = maps.side;
  const auto bytes = static_cast<std::size_t>(maps.normal_bits / 8);
  const std::size_t values = maps.normal.size() / bytes;
  image.rgba.assign(4 * (values / 3), 255);
  for (std::size_t i = 0; i < values; ++i) image.rgba[i / 3 * 4 + i % 3] = maps.normal[bytes * i];
}

/// preview.png of what is delivered. A picture that cannot be made costs the job nothing but a warning.
Result<Bytes> preview_of(const BakeInput& input, const Bytes& glb, const SurfaceMaps& maps, BakeLog& log,
                         Threads& threads) {
  ImportLimits limits;
  limits.max_memory_bytes = input.recipe.limits.memory_mb << 20;
  limits.max_total_pixels = std::min(limits.max_total_pixels, limits.max_memory_bytes / 16);
  KILN_TRY(light, job_light(input));
  KILN_TRY(scene, import_scene({.name = "scene.glb", .main = glb, .resources = {}}, limits));
  put_normal_map(scene, maps);
  const Tracer tracer(scene, threads);
  const auto advance = [&](std::uint64_t done, std::uint64_t total) { log.advance(done, total); };
  return render_plain_preview(tracer, light ? *light : overcast_sky(), {.advance = advance}, threads);
}

/// The reduction alone.
Result<BakeOutput> bake_reduction(const BakeInput& input, const Progress& progress, Threads& threads) {
  BakeLog log(progress);
  log.begin("read", 0.01);
  KILN_TRY(p, prepare(input));
  threads.check();
  const std::span<const std::uint8_t> file = input.scene.main;
  const bool as_it_is = p.plan.unchanged && looks_like_glb(file) && input.scene.resources.empty();
  p.params.begin = [&](const std::string& stage, double fraction) { log.begin(stage, fraction); };
  p.params.advance = [&](std::uint64_t done, std::uint64_t total) { log.advance(done, total); };
  const auto make = [&]() -> Result<Reduced> {
    if (!as_it_is) return reduce(p.source, p.plan, p.params, threads);
    log.begin("measure", 0.9);  // its numbers are checked all the same
    KILN_TRY(extent, measure(p.source, threads));
    return Reduced{.frame = extent.frame(), .input_triangles = extent.triangles};
  };
  KILN_TRY(reduced, make());
  if (reduced.map_left_out) {
    p.warnings.push_back(
        {"normal_map_left_out",
         "The pieces of the surface do not fit into the largest normal map that limits.memory_mb allows.",
         "/steps/0/normal_map"});
  }
  const double written_at = p.preview_bytes > 0 ? 0.96 : 1;
  log.begin("write", written_at);
  Bytes glb;
  if (as_it_is) {
    glb.assign(file.begin(), file.end());
  } else {
    KILN_TRY(written, write_reduced_glb({.mesh = reduced.mesh,
                                         .maps = reduced.maps,
                                         .frame = reduced.frame,
                                         .name = stem_of(input.scene.name),
                                         .provenance = provenance(input)}));
    glb = std::move(written);
  }
  const std::uint64_t triangles = p.plan.unchanged ? reduced.input_triangles : reduced.mesh.triangles.size();
  const std::size_t vertices = as_it_is ? p.source.vertices : reduced.mesh.position.size();
  Bytes preview;
  if (p.preview_bytes > 0) {
    reduced.mesh = {};  // room for its copy in the tracer
    log.begin("preview", 1);
    auto made = preview_of(input, glb, reduced.maps, log, threads);
    if (made)
      preview = std::move(*made);
    else
      p.warnings.push_back(
          {"preview_left_out", "There is no preview.png: " + made.error().message, made.error().where});
  }
  log.end();
  ordered_json report = report_head(input, p, log);
  report["scene"]["triangles"] = reduced.input_triangles;
  report["result"] = {{"triangles", triangles}, {"vertices", vertices}, {"bytes", glb.size()}};
  report["reduce"] = {{"unchanged", p.plan.unchanged},
                      {"clustered_triangles", reduced.clustered_triangles},
                      {"error", error_object(reduced)},
                      {"normal_degrees_rms", reduced.normal_degrees},
                      {"normal_degrees_rms_without_map", reduced.plain_normal_degrees},
                      {"charts", reduced.charts},
                      {"texels_filled", reduced.maps.filled},
                      {"own_memory_bytes", std::max(reduced.own_memory_bytes, own_memory_bytes())}};
  return output_of(std::move(glb), std::move(preview), text_of(report), log_text(p, log));
}

/// The progress of one of two bakes that follow each other.
Progress part_of(const Progress& whole, double begin, double end) {
  if (!whole) return {};
  return [&whole, begin, end](ProgressEvent event) {
    event.fraction = begin + (end - begin) * event.fraction;
    whole(event);
  };
}

ArtifactFile& file_of(BakeOutput& output, const char* name) {
  return *std::find_if(output.files.begin(), output.files.end(), [&](const ArtifactFile& f) { return f.name == name; });
}

/// What the rest of a recipe, baked by itself, says of its only step is about the second.
std::string about_second_step(std::string text) {
  constexpr std::string_view kFirst = "/steps/0";
  for (std::size_t at = 0; (at = text.find(kFirst, at)) != std::string::npos; at += kFirst.size())
    text[at + kFirst.size() - 1] = '1';
  return text;
}

/// What the reduction did joins the report and the log of the bake that went on from it.
void join_reports(const BakeInput& input, BakeOutput& first, BakeOutput& output) {
  const ordered_json before = ordered_json::parse(file_of(first, "report.json").bytes);
  const Bytes& own = file_of(output, "report.json").bytes;
  ordered_json report = ordered_json::parse(about_second_step(std::string(own.begin(), own.end())));
  const auto prepend = [&](const char* name) {
    ordered_json list = before[name];
    list.insert(list.end(), report[name].begin(), report[name].end());
    report[name] = std::move(list);
  };
  for (const char* name : {"plan", "stages", "warnings"}) prepend(name);
  report["recipe"] = ordered_json::parse(recipe_json(input.recipe));
  report["seconds"] = report["seconds"].get<double>() + before["seconds"].get<double>();
  report["reduce"] = before["reduce"];
  report["reduce"]["input"] = before["scene"];
  const std::string text = text_of(report);
  file_of(output, "report.json").bytes = Bytes(text.begin(), text.end());
  Bytes log = file_of(first, "log.txt").bytes;
  const Bytes& rest = file_of(output, "log.txt").bytes;
  log.insert(log.end(), rest.begin(), rest.end());
  file_of(output, "log.txt").bytes = std::move(log);
}

}  // namespace

Result<BakeOutput> bake_reduced(const BakeInput& input, const Progress& progress, Threads& threads,
                                const Checkpoints& checkpoints) {
  constexpr double kShare = 0.4;  // of the progress
  if (!input.recipe.bakes_light()) return bake_reduction(input, progress, threads);
  KILN_TRY(first, bake_reduction(input, part_of(progress, 0, kShare), threads));
  BakeInput rest = input;
  rest.scene = {.name = stem_of(input.scene.name) + ".glb",
                .main = std::move(file_of(first, "scene.glb").bytes),
                .resources = {}};
  rest.recipe.reduce.reset();
  rest.made_of = provenance(input);
  Result<BakeOutput> output = bake(rest, part_of(progress, kShare, 1), threads, checkpoints);
  if (!output) {
    const Fault& f = output.error();
    return fault(f.code, about_second_step(f.message), about_second_step(f.where));
  }
  join_reports(input, first, *output);
  return output;
}

Result<std::string> reduce_plan_json(const BakeInput& input) {
  KILN_TRY(p, prepare(input));
  ordered_json prediction = prediction_object(p);
  prediction["of"] = "the bake";
  return text_of({{"plan", decision_list(p)},
                  {"parameters", parameters_object(p)},
                  {"prediction", prediction},
                  {"warnings", warning_list(p)}});
}

}  // namespace kiln
