#include "core/bake/light_field_stage.h"

#include "core/artifact/progressive_glb.h"
#include "core/bake/carried_light.h"
#include "core/bake/light_field_step.h"

namespace kiln {
namespace {

/// Level k of a scene that has everything else.
void put_level(FieldLevel& level, BakedScene& baked) {
  baked.scene.mesh = std::move(level.mesh);
  baked.field = std::move(level.field);
  baked.transfer = std::move(level.transfer);
}

FieldLevelReport report_of(const FieldLevel& level, std::string file) {
  return {.file = std::move(file), .estimate = level.estimate, .reached = level.reached, .certificate = {}};
}

}  // namespace

LightFieldStage::LightFieldStage(BakedScene& baked, OutgoingLight outgoing, Plan& plan, BakeLog& log, Threads& threads)
    : plan_(plan), surface_(baked.scene) {
  outcome_.degree = outgoing.field.degree;
  outcome_.noise = outgoing.noise;
  outcome_.carried = plan.field->carried;
  outcome_.baked_triangles = baked.scene.mesh.triangles.size();
  outcome_.baked_vertices = baked.scene.mesh.position.size();
  if (outgoing.field.has_sky()) {
    baked.sky = std::move(outgoing.sky);
    baked.lobes = make_lobe_table(1);
  }
  log.begin("simplify", 0.9);
  levels_ = make_levels(surface_.mesh, baked.transfer, std::move(outgoing.field), *plan.field, log, threads);
  const FieldLevel& first = levels_.levels.front();
  decide(plan, "simplified", std::to_string(first.mesh.triangles.size()) + " triangles",
         "of " + std::to_string(outcome_.baked_triangles) +
             (outcome_.carried ? " that the file has" : " that were baked") + "; it adds an estimated " +
             short_text(100 * first.estimate) + " % of the light" +
             (first.reached ? "" : "; topology or shape allow no fewer"));
  encoding_ = choose_field_encoding(first.field, first.mesh, plan);
  outcome_.rank = encoding_.components.rank();
  if (levels_.progressive) progressive_ = encode_progressive(*levels_.progressive, encoding_.components.rows);
  levels_.progressive.reset();
  for (std::size_t k = 0; k < levels_.levels.size(); ++k)
    outcome_.levels.push_back(report_of(levels_.levels[k], k == 0 ? "scene.glb" : "lod" + std::to_string(k) + ".glb"));
  put_level(levels_.levels.front(), baked);
}

Result<FieldOutcome> LightFieldStage::finish(Bytes& glb, const BakedScene& decoded, const Job& job, BakeLog& log,
                                             Threads& threads) {
  std::optional<Tracer> truth;
  if (!job.carried && job.recipe.certificate) truth.emplace(job.surface, threads);
  const auto judge = [&](const BakedScene& shown, std::uint64_t bytes, FieldLevelReport& level) {
    level.triangles = shown.scene.mesh.triangles.size();
    level.vertices = shown.scene.mesh.position.size();
    level.bytes = bytes;
    if (!job.recipe.certificate) return;
    level.certificate = job.carried
                            ? certify_carried({shown, job.surface.mesh, *job.carried, job.recipe.seed}, threads)
                            : certify_field({shown, *truth, job.environment, log.rays(), job.recipe.seed}, threads);
  };
  if (!progressive_.empty()) {
    outcome_.progressive_bytes = progressive_.size();
    KILN_TRY(with, add_progressive(glb, progressive_));
    glb = std::move(with);
  }
  judge(decoded, glb.size(), outcome_.levels.front());
  for (std::size_t k = 1; k < levels_.levels.size(); ++k) {
    BakedScene level = decoded;
    put_level(levels_.levels[k], level);
    Encoding encoding{.transfer = {.bits = plan_.raw_bits}};
    encoding.field = choose_field_encoding(level.field, level.scene.mesh, plan_);
    KILN_TRY(file, write_baked_glb(level, encoding));
    KILN_TRY(shown, read_baked_glb(file));
    shown.scene.images = decoded.scene.images;
    judge(shown, file.size(), outcome_.levels[k]);
    outcome_.lods.push_back(std::move(file));
    threads.check();
  }
  return std::move(outcome_);
}

}  // namespace kiln
