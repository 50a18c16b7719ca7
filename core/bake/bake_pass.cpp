#include "core/bake/bake_pass.h"

#include <cmath>
#include <memory>

#include "core/artifact/look.h"
#include "core/artifact/points_glb.h"
#include "core/bake/carried_light.h"
#include "core/bake/compression.h"
#include "core/bake/grid_step.h"
#include "core/bake/light_field_step.h"
#include "core/bake/lightings.h"
#include "core/bake/provenance.h"
#include "core/bake/radiosity_step.h"
#include "core/bake/transport.h"

namespace kiln {
namespace {

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

constexpr int kLightmapBits = 20;  // of TEXCOORD_1 under a lightmap: a step of 1/128 texel at 8192 x 8192

/// The delivered file, read back, with the input's pixels so that textures show in the preview, and its warnings
/// for the report.
Result<BakedScene> reopen(const Bytes& file, const Scene& scene) {
  KILN_TRY(decoded, read_baked_glb(file));
  decoded.scene.images = scene.images;
  decoded.scene.warnings = scene.warnings;
  return decoded;
}

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
  hooks.lit = [&](const Tracer& tracer, const LitSurface* surface, const Mesh& mesh, std::span<const Vec3f> value) {
    const GatherFaces faces(tracer.scene());
    const IncidentLight::World world{tracer, faces, surface, sky};
    if (plan.grid) outcome = bake_grid_step({world, input.recipe, provenance(input)}, plan, log, threads);
    if (plan.field) {
      log.begin("light field", 0.88);
      Scene refined = tracer.scene();
      refined.mesh = mesh;
      out.outgoing = bake_light_field(world, {refined, value}, plan, log, threads);
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

}  // namespace

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
    if (light) own = baked_light(*light, plan.order);
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
    pass.certificate =
        certify(decoded, truth, light,
                {.bake_rays = log.rays() - rays_before,
                 .thorough = input.recipe.promise.target_error && (!plan.radiosity || input.recipe.radiosity),
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

}  // namespace kiln
