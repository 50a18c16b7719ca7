#include "core/bake/light_field_stage.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/artifact/progressive_glb.h"
#include "core/bake/carried_light.h"
#include "core/bake/light_field_step.h"

namespace kiln {
namespace {

/// Radiance of the last band: root mean square over vertices, eyes and channels, relative to the mean, without what the
/// rays' noise is in it (even over all numbers).
double last_band(const LightField& field, double noise) {
  const std::size_t count = field.count(), first = count - static_cast<std::size_t>(2 * field.degree + 1);
  double squares = 0, mean = 0;
  for (std::size_t v = 0; v < field.vertices(); ++v) {
    const std::vector<double> rgb = mean_light(field, v);
    for (std::size_t c = 0; c < 3; ++c) {
      mean += rgb[c * count] / (2 * std::sqrt(std::numbers::pi));
      for (std::size_t i = c * count + first; i < (c + 1) * count; ++i)
        squares += rgb[i] * rgb[i] / (4 * std::numbers::pi);
    }
  }
  const double n = 3 * static_cast<double>(std::max<std::size_t>(1, field.vertices()));
  const double noisy = noise * noise * static_cast<double>(count - first) / static_cast<double>(count);
  return mean > 0 ? std::sqrt(std::max(0.0, squares / n / std::pow(mean / n, 2) - noisy)) : 0;
}

/// Level k of a scene that has everything else.
void put_level(FieldLevel& level, BakedScene& baked) {
  baked.scene.mesh = std::move(level.mesh);
  baked.field = std::move(level.field);
  baked.transfer = std::move(level.transfer);
}

FieldLevelReport report_of(const FieldLevel& level, std::string file) {
  return {
      .file = std::move(file), .estimate = level.estimate, .reached = level.reached, .follows = {}, .certificate = {}};
}

}  // namespace

/// What is neither noise nor simplification nor storage lies in places between vertices and in bands.
PassRecord field_record(const FieldOutcome& field) {
  const FieldCertificate& own = *field.levels.front().certificate;
  const ErrorStats& error = own.radiance;
  const double added = field.levels.front().estimate, squared = error.relrmse * error.relrmse;
  const double baked = field.baked ? field.baked->relrmse : std::sqrt(std::max(0.0, squared - added * added));
  // Between vertices noise is a mean of three: half of its square, in the mean over a triangle.
  const double noise = std::min(field.noise / std::sqrt(2.0), baked);
  return {.order = field.degree,
          .samples = field.rays,
          .triangles = field.baked_triangles,
          .vertices = field.baked_vertices,
          .certificate_seconds = own.seconds + field.search_seconds,
          .relrmse = error.relrmse,
          .low = error.interval_low,
          .high = error.interval_high,
          .own_relrmse = {},
          .own_high = {},
          .sources = {.noise = noise,
                      .noise_of_reflections = noise,
                      .compression = field.storage,
                      .interpolation = std::sqrt(baked * baked - noise * noise),
                      .merging = added,
                      .truncation = field.last_band}};
}

LightFieldStage::LightFieldStage(BakedScene& baked, OutgoingLight outgoing, Plan& plan, const Job& job, BakeLog& log,
                                 Threads& threads)
    : plan_(plan), job_(job), rays_(outgoing.rays), surface_(baked.scene) {
  outcome_.degree = outgoing.field.degree;
  outcome_.rays = plan.field->outgoing.rays;
  outcome_.noise = outgoing.noise;
  outcome_.storage = plan.field->storage;
  outcome_.last_band = last_band(outgoing.field, outgoing.noise);
  outcome_.carried = plan.field->carried;
  outcome_.baked_triangles = baked.scene.mesh.triangles.size();
  outcome_.baked_vertices = baked.scene.mesh.position.size();
  baked.sky = std::move(outgoing.sky);
  log.begin("simplify", 0.9);
  levels_ = simplified(baked, std::move(outgoing.field), log, threads);
  outcome_.baked = levels_.baked;
  const FieldLevel& first = levels_.levels.front();
  decide(plan, "simplified", std::to_string(first.mesh.triangles.size()) + " triangles",
         "of " + std::to_string(outcome_.baked_triangles) +
             (outcome_.carried ? " that the file has" : " that were baked") + "; it adds an estimated " +
             short_text(100 * first.estimate) + " % of the light" +
             (first.reached ? "" : "; topology or shape allow no fewer"));
  encoding_ = choose_field_encoding(first.field, first.mesh, plan);
  outcome_.rank = encoding_.components.rank();
  if (levels_.progressive)
    progressive_ = encode_progressive(*levels_.progressive, encoding_.components.rows, encoding_.weight_step);
  levels_.progressive.reset();
  for (std::size_t k = 0; k < levels_.levels.size(); ++k)
    outcome_.levels.push_back(report_of(levels_.levels[k], k == 0 ? "scene.glb" : "lod" + std::to_string(k) + ".glb"));
  put_level(levels_.levels.front(), baked);
}

FieldLevels LightFieldStage::simplified(const BakedScene& baked, LightField field, BakeLog& log, Threads& threads) {
  if (!plan_.field->target)
    return make_levels(surface_.mesh, baked.transfer, std::move(field), *plan_.field, {}, log, threads);
  std::optional<Tracer> truth;
  if (job_.carried == nullptr) truth.emplace(surface_, threads);
  BakedScene shown{.scene = surface_};
  shown.sky = baked.sky;
  const auto judge = [&](const Mesh& mesh, const LightField& light) {
    shown.scene.mesh = mesh;
    shown.field = light;
    const FieldCertificate c = certify(shown, surface_, truth ? &*truth : nullptr, threads);
    outcome_.search_seconds += c.seconds;
    return c.radiance;
  };
  return make_levels(surface_.mesh, baked.transfer, std::move(field), *plan_.field, judge, log, threads);
}

FieldCertificate LightFieldStage::certify(const BakedScene& shown, const Scene& surface, const Tracer* truth,
                                          Threads& threads) const {
  const std::uint64_t seed = job_.recipe.seed;
  if (job_.carried != nullptr) return certify_carried({shown, surface, *job_.carried, shown.sky, seed}, threads);
  return certify_field(
      {.decoded = shown, .truth = *truth, .environment = job_.environment, .bake_rays = rays_, .seed = seed}, threads);
}

Result<FieldOutcome> LightFieldStage::finish(Bytes& glb, const BakedScene& decoded, const Scene& surface,
                                             Threads& threads) {
  std::optional<Tracer> truth;
  const bool certified = job_.recipe.certificate;
  if (job_.carried == nullptr && certified) truth.emplace(surface, threads);
  const auto judge = [&](const BakedScene& shown, std::uint64_t bytes, FieldLevelReport& level) {
    level.triangles = shown.scene.mesh.triangles.size();
    level.vertices = shown.scene.mesh.position.size();
    level.bytes = bytes;
    if (certified) level.certificate = certify(shown, surface, truth ? &*truth : nullptr, threads);
  };
  if (!progressive_.empty()) {
    outcome_.progressive_bytes = progressive_.size();
    KILN_TRY(with, add_progressive(glb, progressive_));
    glb = std::move(with);
  }
  judge(decoded, glb.size(), outcome_.levels.front());
  LevelPictures before;
  if (levels_.levels.size() > 1) before = level_pictures(decoded, decoded.scene.mesh, threads);
  for (std::size_t k = 1; k < levels_.levels.size(); ++k) {
    BakedScene level = decoded;
    put_level(levels_.levels[k], level);
    Encoding encoding{.transfer = {.bits = plan_.raw_bits}};
    encoding.field = choose_field_encoding(level.field, level.scene.mesh, plan_);
    KILN_TRY(file, write_baked_glb(level, encoding));
    KILN_TRY(shown, read_baked_glb(file));
    shown.scene.images = decoded.scene.images;
    judge(shown, file.size(), outcome_.levels[k]);
    LevelPictures pictures = level_pictures(shown, decoded.scene.mesh, threads);
    outcome_.levels[k].follows = level_switch(before, pictures);
    before = std::move(pictures);
    outcome_.lods.push_back(std::move(file));
    threads.check();
  }
  return std::move(outcome_);
}

}  // namespace kiln
