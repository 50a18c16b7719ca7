#include "core/bake/bake.h"

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "core/artifact/baked_scene.h"
#include "core/artifact/evaluate.h"
#include "core/artifact/look.h"
#include "core/artifact/streams.h"
#include "core/bake/bake_log.h"
#include "core/bake/certificate.h"
#include "core/bake/job_light.h"
#include "core/bake/plan.h"
#include "core/bake/preview.h"
#include "core/bake/report.h"
#include "core/bake/transport.h"
#include "core/base/sha256.h"

namespace kiln {
namespace {

Result<Scene> read_scene(const BakeInput& input) {
  ImportLimits limits;
  limits.max_memory_bytes = input.recipe.limits.memory_mb << 20;
  KILN_TRY(scene, import_scene(input.scene, limits));
  if (input.recipe.strict && !scene.warnings.empty()) {
    const Warning& first = scene.warnings.front();
    return fault("strict_" + first.code, "strict: " + first.message, first.where);
  }
  return scene;
}

std::string megabytes(std::uint64_t bytes) { return std::to_string((bytes + (1U << 20) - 1) >> 20) + " MB"; }

Result<void> check_memory(const Plan& plan, const Limits& limits) {
  if (plan.prediction.memory_bytes <= limits.memory_mb << 20) return {};
  return fault("memory_limit", "the bake would need about " + megabytes(plan.prediction.memory_bytes) +
                                   " and limits.memory_mb allows " + std::to_string(limits.memory_mb) +
                                   " MB; lower /steps/0/subdivide/triangles or /steps/0/order, or raise the limit");
}

std::string provenance(const BakeInput& input) {
  const std::string identity = recipe_identity(input.recipe);
  const auto bytes = std::span(reinterpret_cast<const std::uint8_t*>(identity.data()), identity.size());
  const nlohmann::ordered_json json = {{"engine", std::string("kiln ") + kEngineVersion},
                                       {"scene_sha256", sha256_hex(input.scene.main)},
                                       {"recipe_sha256", sha256_hex(bytes)},
                                       {"seed", input.recipe.seed}};
  return json.dump();
}

/// The baked scene before it is written: transport, the job's light, and an exposure that suits both.
BakedScene assemble(Scene scene, Transfer transfer, const std::optional<Environment>& light,
                    std::string provenance_json) {
  BakedScene baked;
  baked.scene = std::move(scene);
  baked.transfer = std::move(transfer);
  if (light) baked.light = {light->name, project_environment(*light, baked.transfer.order)};
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

/// The delivered file, read back, with the input's pixels so that textures show in the preview.
Result<BakedScene> reopen(const Bytes& file, const Scene& scene) {
  KILN_TRY(decoded, read_baked_glb(file));
  decoded.scene.images = scene.images;
  return decoded;
}

}  // namespace

Result<BakeOutput> bake(const BakeInput& input, const Progress& progress, Threads& threads) {
  BakeLog log(progress);
  log.begin("read", 0.05);
  KILN_TRY(scene, read_scene(input));
  KILN_TRY(light, job_light(input));
  const std::uint64_t input_vertices = scene.mesh.position.size(), input_triangles = scene.mesh.triangles.size();
  threads.check();

  log.begin("plan", 0.06);
  Plan plan = make_plan(scene, input.recipe.steps.front(), input.recipe.quality, threads);
  if (auto memory = check_memory(plan, input.recipe.limits); !memory) return tl::make_unexpected(memory.error());

  if (!light && !plan.lamps) {
    scene.warnings.push_back(
        {"no_light", "No environment was asked for and the scene has no lights: it looks black.", ""});
  }

  Transfer transfer = solve_transport(scene, plan, input.recipe.seed, log, threads);

  log.begin("write", 0.9);
  BakedScene baked = assemble(std::move(scene), std::move(transfer), light, provenance(input));
  const Encoding encoding{.coefficient_bits = plan.coefficient_bits};
  KILN_TRY(glb, write_baked_glb(baked, encoding));
  KILN_TRY(streams, stream_bytes(baked, encoding, glb));
  baked.transfer = {};  // from here on the delivered file is what counts
  KILN_TRY(decoded, reopen(glb, baked.scene));
  threads.check();

  std::optional<Certificate> certificate;
  if (input.recipe.certificate) {
    log.begin("certificate", 0.97);
    const Tracer truth(baked.scene, threads);
    certificate = certify(decoded, truth, light, {.bake_rays = log.rays(), .seed = input.recipe.seed}, threads);
  }

  log.begin("preview", 1.0);
  const Tracer picture(decoded.scene, threads);
  KILN_TRY(preview, render_preview(decoded, picture, {}, threads));
  log.end();

  const std::string report = report_json({.input = baked.scene,
                                          .input_vertices = input_vertices,
                                          .input_triangles = input_triangles,
                                          .plan = plan,
                                          .recipe = input.recipe,
                                          .log = log,
                                          .result = decoded.scene.mesh,
                                          .result_bytes = glb.size(),
                                          .streams = streams,
                                          .certificate = certificate});
  BakeOutput output;
  output.files.push_back({"scene.glb", "model/gltf-binary", std::move(glb)});
  output.files.push_back({"preview.png", "image/png", std::move(preview)});
  output.files.push_back({"report.json", "application/json", to_bytes(report)});
  output.files.push_back({"log.txt", "text/plain; charset=utf-8", to_bytes(log_text(plan, log, baked.scene))});
  return output;
}

Result<std::string> plan_json(const BakeInput& input, Threads& threads) {
  KILN_TRY(scene, read_scene(input));
  if (auto light = job_light(input); !light) return tl::make_unexpected(light.error());
  const Plan plan = make_plan(scene, input.recipe.steps.front(), input.recipe.quality, threads);
  if (auto memory = check_memory(plan, input.recipe.limits); !memory) return tl::make_unexpected(memory.error());
  return plan_report_json(plan, scene);
}

}  // namespace kiln
