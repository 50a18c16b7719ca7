#include "core/bake/bake.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "core/artifact/baked_scene.h"
#include "core/artifact/evaluate.h"
#include "core/artifact/look.h"
#include "core/artifact/points_glb.h"
#include "core/artifact/streams.h"
#include "core/bake/bake_log.h"
#include "core/bake/carried_light.h"
#include "core/bake/certificate.h"
#include "core/bake/checkpoint.h"
#include "core/bake/choose_plan.h"
#include "core/bake/compression.h"
#include "core/bake/glossy_certificate.h"
#include "core/bake/grid_step.h"
#include "core/bake/job_light.h"
#include "core/bake/light_field_stage.h"
#include "core/bake/light_field_step.h"
#include "core/bake/lightings.h"
#include "core/bake/lightmap_step.h"
#include "core/bake/links_step.h"
#include "core/bake/plan.h"
#include "core/bake/preview.h"
#include "core/bake/progressive.h"
#include "core/bake/provenance.h"
#include "core/bake/radiosity_step.h"
#include "core/bake/reduce_step.h"
#include "core/bake/report.h"
#include "core/bake/transport.h"
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

/// The baked scene before it is written: transport, the job's light, and an exposure that suits both.
BakedScene assemble(Scene scene, Transport transport, BakedLight light, std::string provenance_json) {
  BakedScene baked;
  baked.scene = std::move(scene);
  baked.transfer = std::move(transport.transfer);
  baked.glossy = std::move(transport.glossy.transfer);
  if (baked.glossy) baked.lobes = make_lobe_table(baked.glossy.order);
  baked.light = std::move(light);
  baked.exposure = automatic_exposure(baked.scene.mesh, baked_colors(baked));
  baked.provenance = std::move(provenance_json);
  return baked;
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

constexpr int kLightmapBits = 20;  // of TEXCOORD_1 under a lightmap: a step of 1/128 texel at 8192 x 8192

/// The delivered file, read back, with the input's pixels so that textures show in the preview, and its warnings
/// for the report.
Result<BakedScene> reopen(const Bytes& file, const Scene& scene) {
  KILN_TRY(decoded, read_baked_glb(file));
  decoded.scene.images = scene.images;
  decoded.scene.warnings = scene.warnings;
  return decoded;
}

/// One whole bake of the scene as planned: an artefact and what is known of its error.
struct Pass {
  Plan plan;
  Bytes glb;
  std::vector<StreamBytes> streams;
  std::size_t rank = 0;  // of the stored components; 0: raw
  BakedScene decoded;
  std::uint64_t bounce_rays = 0, points = 0, gathered = 0;
  std::optional<MergeOutcome> merge;
  std::optional<Certificate> certificate;
  std::optional<ErrorSources> sources;
  std::optional<GridOutcome> grid;
  std::optional<LinksOutcome> links;
  std::optional<LightmapOutcome> lightmap;
  std::optional<PointsOutcome> point_field;
  std::optional<FieldOutcome> field;
  std::optional<GlossyReport> glossy;
  std::optional<MeshlessOutcome> meshless;
};

/// What the steps that light the scene as `radiosity` does make besides.
struct LitResults {
  SolvedRadiosity solved;
  std::optional<GridOutcome> grid;
  std::optional<OutgoingLight> outgoing;
};

/// What else the solution is asked for, or null.
struct LitBeside {
  const LinksStep* links = nullptr;
  LightmapStep* lightmap = nullptr;
  PointField* points = nullptr;
};

/// The step `radiosity`, and where the plan has one the grid or the light field that looks at its surface.
Result<LitResults> solve_light(const BakeInput& input, Scene& scene, const Environment* sky, Plan& plan,
                               const LitBeside& beside, BakeLog& log, Threads& threads) {
  plan.radiosity->seed = plan.radiosity->points.seed = input.recipe.seed;
  LitResults out;
  Result<GridOutcome> outcome;
  RadiosityHooks hooks;
  hooks.sources = input.recipe.radiosity && input.recipe.certificate;
  hooks.lit = [&](const Tracer& tracer, const LitSurface* surface, std::span<const Vec3f> value) {
    const GatherFaces faces(tracer.scene());
    const IncidentLight::World world{tracer, faces, surface, sky};
    if (plan.grid)
      outcome = bake_grid_step({world, input.recipe, provenance(input), plan.radiosity->bounces}, plan, log, threads);
    if (plan.field) {
      log.begin("light field", 0.88);
      out.outgoing = bake_light_field(world, value, plan, log, threads);
    }
  };
  std::optional<FinishSource> finish;
  if (beside.lightmap != nullptr) {
    hooks.places = beside.lightmap->places();
    hooks.lit_places = [&](const LitPlaces& lit) { beside.lightmap->light(lit, threads); };
  }
  if (beside.points != nullptr) {
    hooks.lit_points = [&](const PointHierarchy& points, std::span<const Vec3f> value) {
      *beside.points = make_point_field(points, value, threads);
    };
  }
  if (beside.links != nullptr) {
    hooks.more = {beside.links->columns(),
                  [&](std::span<const TransferPoint> points) { return beside.links->values(points, threads); }};
  } else if (plan.field) {
    finish.emplace(scene);
    hooks.more = {FinishSource::kWidth,
                  [&](std::span<const TransferPoint> points) { return finish->values(points, threads); }};
  }
  out.solved = solve_radiosity_step(scene, plan, sky, hooks, log, threads);
  if (!outcome) return tl::make_unexpected(outcome.error());
  if (plan.grid) out.grid = std::move(*outcome);
  return out;
}

/// Adds the points to the file and reads them back.
Result<PointsOutcome> deliver_points(Bytes& glb, const PointField& field, Threads& threads) {
  const std::size_t before = glb.size();
  KILN_TRY(with, add_points(glb, field));
  glb = std::move(with);
  KILN_TRY(read, read_points(glb));
  threads.check();
  return PointsOutcome{.levels = read.level_end, .bytes = glb.size() - before};
}

/// Leaves the surface that is the truth in `in.scene`: the refined one, or where vertices were merged that of the
/// input.
Result<Pass> bake_pass(const BakeInput& input, CarriedScene& in, const std::optional<Environment>& light, Plan plan,
                       BakeLog& log, Threads& threads) {
  Scene& scene = in.scene;
  const bool carried = in.carries_light();
  const std::uint64_t rays_before = log.rays();  // a certificate spends by its own pass: a resumed bake has no others
  Pass pass;
  BakedLight own;
  Transport transport;
  std::unique_ptr<LinksStep> links;
  std::optional<LightmapStep> lightmap;
  std::optional<PointField> points;
  std::optional<OutgoingLight> outgoing;
  std::optional<Mesh> unmerged;
  double tail_left = plan.tail_left, points_squared = 0;
  if (plan.merge) unmerged = scene.mesh;
  if (carried) {
    own.name = "that of the file";
    transport.transfer = in.diffuse;
    outgoing.emplace(OutgoingLight{.field = in.field, .sky = in.sky});
  } else if (plan.radiosity) {
    if (light) own.name = light->name;
    if (plan.links) {
      log.begin("links", 0.4);
      links = std::make_unique<LinksStep>(scene, plan, input.recipe.seed, log, threads);
    }
    if (plan.lightmap) {
      if (!plan.lightmap->uv1.empty()) scene.mesh.uv1 = plan.lightmap->uv1;
      lightmap.emplace(scene, plan, threads);
    }
    if (input.recipe.radiosity && input.recipe.radiosity->deliver.points) points.emplace();
    const LitBeside beside{links.get(), lightmap ? &*lightmap : nullptr, points ? &*points : nullptr};
    KILN_TRY(lit, solve_light(input, scene, light ? &*light : nullptr, plan, beside, log, threads));
    transport.transfer = std::move(lit.solved.transfer);
    transport.noise = std::move(lit.solved.noise);
    transport.bounce_rays = lit.solved.gather_rays;
    tail_left = lit.solved.tail, points_squared = lit.solved.points_squared;
    pass.points = lit.solved.points, pass.gathered = lit.solved.gathered;
    pass.grid = std::move(lit.grid);
    outgoing = std::move(lit.outgoing);
  } else {
    if (light) own = {light->name, project_environment(*light, plan.order)};
    transport = solve_transport(scene, plan, band_power(plan.order, own), input.recipe.seed, log, threads);
  }
  log.begin("write", 0.9);
  const double left_out = transport.glossy.left_out, glossy_noise = transport.glossy.noise;
  const NoiseProbes noise = std::move(transport.noise);
  pass.bounce_rays = transport.bounce_rays;
  pass.merge = transport.merge;
  pass.meshless = transport.meshless;
  BakedScene baked = assemble(std::move(scene), std::move(transport), std::move(own), provenance(input));
  if (lightmap && !input.recipe.radiosity->deliver.vertices) baked.exposure = lightmap->exposure();
  std::optional<LightFieldStage> stage;
  if (outgoing) {
    pass.bounce_rays = outgoing->rays;
    stage.emplace(baked, std::move(*outgoing), plan,
                  LightFieldStage::Job{light, input.recipe, carried ? &in.field : nullptr}, log, threads);
  }
  Encoding encoding{.transfer = choose_encoding(baked, plan).encoding};
  if (baked.glossy)
    encoding.glossy_step = plan.glossy.compression * std::sqrt(6.0 / static_cast<double>(baked.glossy.rank()));
  if (stage) encoding.field = stage->encoding();
  if (lightmap) encoding.lightmap_bits = kLightmapBits;
  const StorageProbes storage = probe_storage(baked, encoding.transfer, noise.direct.vertices);
  KILN_TRY(glb, write_baked_glb(baked, encoding));
  KILN_TRY(streams, stream_bytes(baked, encoding, glb));
  scene = stage ? stage->take_surface() : std::move(baked.scene);
  if (unmerged) scene.mesh = std::move(*unmerged);
  baked = {};  // from here on the delivered file is what counts
  KILN_TRY(decoded, reopen(glb, scene));
  threads.check();
  if (links) {
    log.begin("read links", 0.93);
    KILN_TRY(outcome, links->finish(glb, decoded, input.recipe, threads));
    pass.links = std::move(outcome);
    pass.bounce_rays += pass.links->stats.rays;
    streams.push_back({"links", pass.links->bytes});
  }
  if (lightmap) {
    log.begin("lightmap", 0.95);
    const Tracer truth(scene, threads);
    const LightmapStep::Job job{
        decoded, truth, light ? &*light : nullptr, plan.radiosity->bounces, input.recipe, provenance(input)};
    KILN_TRY(outcome, lightmap->finish(glb, job, log, threads));
    streams.push_back({"lightmap", outcome.image_bytes});
    if (!input.recipe.radiosity->deliver.vertices) decoded.lightmap = outcome.lightmap;
    pass.lightmap = std::move(outcome);
  }
  if (points) {
    KILN_TRY(outcome, deliver_points(glb, *points, threads));
    streams.push_back({"points", outcome.bytes});
    pass.point_field = std::move(outcome);
  }
  if (input.recipe.certificate) log.begin("certificate", 1.0);
  const bool to_vertices = !input.recipe.radiosity || input.recipe.radiosity->deliver.vertices;
  if (input.recipe.certificate && !carried && to_vertices) {
    const Tracer truth(scene, threads);
    pass.certificate = certify(decoded, truth, light,
                               {.bake_rays = log.rays() - rays_before,
                                .thorough = input.recipe.promise && (!plan.radiosity || input.recipe.radiosity),
                                .seed = input.recipe.seed},
                               threads);
    if (!plan.radiosity || input.recipe.radiosity) {
      const double merging = pass.merge ? pass.merge->error : 0;
      pass.sources = split_error(*pass.certificate, decoded, {noise, storage, tail_left, merging, points_squared});
    }
  }
  if (stage) {
    KILN_TRY(outcome, stage->finish(glb, decoded, scene, threads));
    pass.field = std::move(outcome);
  }
  if (decoded.glossy) {
    pass.glossy = GlossyReport{.order = decoded.glossy.order,
                               .channels = decoded.glossy.channels,
                               .vertices = decoded.glossy.vertices.size(),
                               .rank = decoded.glossy.rank(),
                               .compression = left_out,
                               .noise = glossy_noise,
                               .certificate = {}};
    if (input.recipe.certificate) {
      const Tracer truth(scene, threads);
      pass.glossy->certificate = certify_glossy(
          decoded, truth, light, {.bake_rays = log.rays() - rays_before, .seed = input.recipe.seed}, threads);
    }
  }
  pass.rank = encoding.transfer.components.rank();
  pass.plan = std::move(plan);
  pass.glb = std::move(glb);
  pass.streams = std::move(streams);
  pass.decoded = std::move(decoded);
  return pass;
}

PassRecord record_of(const Pass& pass, double seconds, std::uint64_t rays, double elapsed_s) {
  PassRecord out;
  if (pass.field) {
    out = field_record(*pass.field);
  } else if (pass.links) {
    out = links_record(*pass.links, pass.plan, pass.decoded.scene.mesh);
  } else {
    const ErrorStats& error = pass.certificate->transport;
    out = {.order = pass.plan.order,
           .samples = pass.plan.samples,
           .bounce_samples = pass.plan.bounce_samples,
           .bounces = pass.plan.bounces,
           .triangles = pass.decoded.scene.mesh.triangles.size(),
           .vertices = pass.decoded.scene.mesh.position.size(),
           .relrmse = error.relrmse,
           .low = error.interval_low,
           .high = error.interval_high,
           .own_relrmse = {},
           .own_high = {},
           .sources = *pass.sources};
    if (pass.certificate->job_light) {
      out.own_relrmse = pass.certificate->job_light->relrmse;
      out.own_high = pass.certificate->job_light->interval_high;
    }
  }
  if (pass.plan.radiosity && !pass.field && !pass.links) {
    out.samples = pass.plan.radiosity->direct.sky, out.bounce_samples = pass.plan.radiosity->rays;
    out.points = pass.points, out.gathered = pass.gathered;
  }
  out.rays = rays;
  out.bounce_rays = pass.bounce_rays;
  out.seconds = seconds;
  if (pass.certificate) out.certificate_seconds += pass.certificate->seconds;
  out.elapsed_s = elapsed_s;
  return out;
}

/// A single pass where a quality was asked for; where a promise was made, passes until it is kept or cannot be.
Result<Pass> bake_passes(const BakeInput& input, CarriedScene in, const std::optional<Environment>& light, Plan plan,
                         Passes& passes, const Checkpoints& checkpoints, BakeLog& log, Threads& threads) {
  constexpr double kFirst = 0.06, kLast = 0.97, kShare = 0.6;  // of what is left of the progress, for each pass
  if (!input.recipe.promise || plan.grid) {                    // a grid has passes of its own
    log.share(0, kLast);
    return bake_pass(input, in, light, std::move(plan), log, threads);
  }
  Scene& scene = in.scene;
  const Mesh surface = scene.mesh;
  std::optional<Pass> newest;
  std::optional<Plan> next = passes.resume(parse_checkpoint(checkpoints.last), std::move(plan), scene);
  const double before = passes.all().empty() ? 0 : passes.all().back().elapsed_s;
  for (double done = kFirst; next; done += kShare * (kLast - done)) {
    scene.mesh = surface;
    const double start = log.seconds();
    const std::uint64_t rays = log.rays();
    log.share(done, done + kShare * (kLast - done));
    if (threads.shares() != nullptr) threads.shares()->begin_pass();
    KILN_TRY(pass, bake_pass(input, in, light, *next, log, threads));
    passes.add(record_of(pass, log.seconds() - start, log.rays() - rays, before + log.seconds()));
    if (checkpoints.save) checkpoints.save(checkpoint_json(passes.all()));
    log.know_error(passes.all().back().relrmse);
    newest = std::move(pass);
    scene.mesh = surface;
    next = passes.next(newest->plan, scene);
  }
  return std::move(*newest);
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
  return plan_report_json(plan, scene, input.recipe.promise);
}

}  // namespace kiln
