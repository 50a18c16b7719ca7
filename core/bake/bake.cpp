#include "core/bake/bake.h"

#include <algorithm>

#include "core/bake/bake_log.h"
#include "core/bake/bake_pass.h"
#include "core/bake/checkpoint.h"
#include "core/bake/choose_plan.h"
#include "core/bake/job_light.h"
#include "core/bake/plan.h"
#include "core/bake/preview.h"
#include "core/bake/progressive.h"
#include "core/bake/reduce_step.h"
#include "core/bake/report.h"
#include "core/base/shared_loop.h"

namespace kiln {
namespace {

Result<CarriedScene> read_scene(const BakeInput& input) {
  ImportLimits limits;
  limits.max_memory_bytes = input.recipe.limits.memory_mb << 20;
  CarriedScene out;
  if (input.recipe.light_field) {
    KILN_TRY(carried, import_carried_scene(input.scene, limits));
    out = std::move(carried);
  } else {
    KILN_TRY(scene, import_scene(input.scene, limits));
    out.scene = std::move(scene);
  }
  if (input.recipe.strict && !out.scene.warnings.empty()) {
    const Warning& first = out.scene.warnings.front();
    return fault("strict_" + first.code, "strict: " + first.message, first.where);
  }
  return out;
}

std::string megabytes(std::uint64_t bytes) { return std::to_string((bytes + (1U << 20) - 1) >> 20) + " MB"; }

Result<void> check_memory(const Plan& plan, const Limits& limits) {
  const bool carried = plan.field && plan.field->carried;
  if (plan.prediction.memory_bytes <= limits.memory_mb << 20) return {};
  return fault(
      "memory_limit",
      "the bake would need about " + megabytes(plan.prediction.memory_bytes) + " and limits.memory_mb allows " +
          std::to_string(limits.memory_mb) + " MB; " +
          (carried          ? "give the file fewer vertices"
           : plan.grid      ? "lower /steps/0/resolution"
           : plan.meshless  ? "raise /steps/0/points/radius, lower /steps/0/subdivide/triangles or /steps/0/order"
           : plan.radiosity ? "raise /steps/0/points/radius, lower /steps/0/rays or subdivide/triangles"
                            : "lower /steps/0/subdivide/triangles or /steps/0/order") +
          ", or raise the limit");
}

std::string log_text(const Plan& plan, const BakeLog& log, const Scene& scene) {
  std::string text = std::string("kiln ") + kEngineVersion + "\n";
  for (const Decision& d : plan.decisions) text += "plan   " + d.decision + " = " + d.value + ": " + d.reason + "\n";
  for (const Warning& w : scene.warnings)
    text += "warn   " + w.code + ": " + w.message + (w.where.empty() ? "" : " (" + w.where + ")") + "\n";
  for (const StageRecord& s : log.stages()) {
    text += "stage  " + s.name + ": " + std::to_string(s.seconds) + " s, " + std::to_string(s.rays) + " rays\n";
  }
  return text;
}

Bytes to_bytes(const std::string& text) { return {text.begin(), text.end()}; }

/// The part of a bake's progress that its passes have, as far as those to come can be told.
class PassProgress {
 public:
  explicit PassProgress(BakeLog& log) : log_(log) { share(kFirstUnknown); }

  void expect(const Ahead& ahead) {
    const double all = log_.seconds() + ahead.seconds;
    done_ = std::max(until_, kLast * log_.seconds() / all);
    share(std::min(1.0, ahead.next_seconds / std::max(ahead.seconds, 1e-9)));
  }

 private:
  static constexpr double kFirst = 0.06, kLast = 0.97, kFirstUnknown = 0.2;
  void share(double of_the_rest) {
    until_ = done_ + of_the_rest * (kLast - done_);
    log_.share(done_, until_);
  }
  BakeLog& log_;
  double done_ = kFirst, until_ = kFirst;
};

/// A single pass where a quality was asked for; where a promise was made, passes until it is kept or cannot be.
Result<Pass> bake_passes(const BakeInput& input, CarriedScene in, const std::optional<Environment>& light, Plan plan,
                         Passes& passes, const Checkpoints& checkpoints, BakeLog& log, Threads& threads) {
  if (!input.recipe.promise || plan.grid) {  // a grid has passes of its own
    log.share(0, 0.97);
    return bake_pass(input, in, light, std::move(plan), log, threads);
  }
  Scene& scene = in.scene;
  const Mesh surface = scene.mesh;
  std::optional<Pass> newest;
  std::optional<Plan> next = passes.resume(parse_checkpoint(checkpoints.last), std::move(plan), scene);
  const double before = passes.all().empty() ? 0 : passes.all().back().elapsed_s;
  PassProgress progress(log);
  while (next) {
    scene.mesh = surface;
    const double start = log.seconds();
    const std::uint64_t rays = log.rays();
    if (threads.shares() != nullptr) threads.shares()->begin_pass();
    KILN_TRY(pass, bake_pass(input, in, light, *next, log, threads));
    passes.add(record_of(pass, log.seconds() - start, log.rays() - rays, before + log.seconds()));
    if (checkpoints.save) checkpoints.save(checkpoint_json(passes.all()));
    log.know_error(passes.all().back().relrmse);
    scene.mesh = surface;
    progress.expect(passes.ahead(pass.plan, scene));
    next = passes.next(pass.plan, scene);
    if (!next) newest = std::move(pass);
  }
  return std::move(*newest);
}

/// What a promise will take: its first pass is baked for a trial and thrown away, since only that tells. Nothing where
/// it takes too long: somebody waits for the plan.
Result<std::optional<Ahead>> foresee(const BakeInput& input, CarriedScene in, const std::optional<Environment>& light,
                                     const Plan& first, Threads& threads) {
  constexpr double kLongestTrial = 25;
  const Mesh surface = in.scene.mesh;
  BakeLog log({});
  Result<Pass> pass;
  threads.stop_after(kLongestTrial);
  try {
    pass = bake_pass(input, in, light, first, log, threads);
  } catch (const Cancelled&) {
    threads.forever();
    threads.check();
    return std::optional<Ahead>();
  }
  threads.forever();
  if (!pass) return tl::make_unexpected(pass.error());
  in.scene.mesh = surface;
  Passes passes(input.recipe.promise, fixed_knobs(input.recipe), input.recipe.limits, passes_of(input.recipe));
  passes.add(record_of(*pass, log.seconds(), log.rays(), log.seconds()));
  Ahead out = passes.ahead(pass->plan, in.scene);
  out.seconds += log.seconds();
  out.rays += log.rays();
  ++out.passes;
  return std::optional(std::move(out));
}

}  // namespace

Result<BakeOutput> bake(const BakeInput& input, const Progress& progress, Threads& threads,
                        const Checkpoints& checkpoints) {
  if (input.recipe.reduce) return bake_reduced(input, progress, threads, checkpoints);
  BakeLog log(progress);
  log.begin("read", 0.05);
  KILN_TRY(in, read_scene(input));
  Scene& scene = in.scene;
  KILN_TRY(light, job_light(input));
  const std::uint64_t input_vertices = scene.mesh.position.size(), input_triangles = scene.mesh.triangles.size();
  threads.check();

  log.begin("plan", 0.06);
  KILN_TRY(plan, plan_of(in, input.recipe, light, threads));
  if (auto memory = check_memory(plan, input.recipe.limits); !memory) return tl::make_unexpected(memory.error());
  scene.warnings.insert(scene.warnings.end(), plan.warnings.begin(), plan.warnings.end());
  if (!light && !plan.lamps && !in.carries_light()) {
    scene.warnings.push_back(
        {"no_light", "No environment was asked for and the scene has no lights: it looks black.", ""});
  }

  Passes passes(input.recipe.promise, fixed_knobs(input.recipe), input.recipe.limits, passes_of(input.recipe));
  KILN_TRY(pass, bake_passes(input, std::move(in), light, plan, passes, checkpoints, log, threads));

  log.share(0.97, 1);
  log.begin("preview", 1.0);
  const Tracer picture(pass.decoded.scene, threads);
  KILN_TRY(preview, render_preview(pass.decoded, picture, {}, threads));
  log.end();

  const std::string report = report_json({.input = pass.decoded.scene,
                                          .input_vertices = input_vertices,
                                          .input_triangles = input_triangles,
                                          .plan = pass.plan,
                                          .recipe = input.recipe,
                                          .log = log,
                                          .result = pass.decoded.scene.mesh,
                                          .result_bytes = pass.glb.size(),
                                          .streams = pass.streams,
                                          .rank = pass.rank,
                                          .certificate = pass.certificate,
                                          .merge = pass.merge,
                                          .sources = pass.sources,
                                          .grid = pass.grid,
                                          .links = pass.links,
                                          .lightmap = pass.lightmap,
                                          .points = pass.point_field,
                                          .field = pass.field,
                                          .glossy = pass.glossy,
                                          .meshless = pass.meshless,
                                          .passes = passes});
  BakeOutput output;
  output.files.push_back({"scene.glb", "model/gltf-binary", std::move(pass.glb)});
  if (pass.grid) output.files.push_back({"grid.exr", "image/x-exr", std::move(pass.grid->file)});
  if (pass.lightmap) output.files.push_back({"lightmap.exr", "image/x-exr", std::move(pass.lightmap->exr)});
  if (pass.field) {
    for (std::size_t k = 0; k < pass.field->lods.size(); ++k) {
      output.files.push_back(
          {"lod" + std::to_string(k + 1) + ".glb", "model/gltf-binary", std::move(pass.field->lods[k])});
    }
  }
  output.files.push_back({"preview.png", "image/png", std::move(preview)});
  output.files.push_back({"report.json", "application/json", to_bytes(report)});
  output.files.push_back(
      {"log.txt", "text/plain; charset=utf-8", to_bytes(log_text(pass.plan, log, pass.decoded.scene))});
  return output;
}

Result<std::string> plan_json(const BakeInput& input, Threads& threads) {
  if (input.recipe.reduce) return reduce_plan_json(input);
  KILN_TRY(in, read_scene(input));
  Scene& scene = in.scene;
  KILN_TRY(light, job_light(input));
  KILN_TRY(plan, plan_of(in, input.recipe, light, threads));
  if (auto memory = check_memory(plan, input.recipe.limits); !memory) return tl::make_unexpected(memory.error());
  scene.warnings.insert(scene.warnings.end(), plan.warnings.begin(), plan.warnings.end());
  std::optional<Ahead> ahead;
  const Promise& promise = input.recipe.promise;
  if (promise.target_error && !plan.grid) {
    KILN_TRY(foreseen, foresee(input, in, light, plan, threads));
    ahead = std::move(foreseen);
  }
  return plan_report_json(plan, scene, promise, ahead);
}

}  // namespace kiln
