#include "tests/bench/trade/run.h"

#include <nlohmann/json.hpp>

#include "core/artifact/baked_scene.h"
#include "core/bake/bake.h"
#include "core/bake/certificate.h"
#include "core/bake/job_light.h"
#include "core/base/sha256.h"
#include "tests/bench/bench.h"
#include "tests/bench/trade/child.h"
#include "tests/bench/trade/csv.h"
#include "tests/core/bake/output_file.h"

namespace kiln::trade {
namespace {

using nlohmann::json;

constexpr std::uint64_t kOtherSeed = 4711;  // bakes have seed 0

using testing::file;

Error error_of(const ErrorStats& stats) { return {stats.relrmse, stats.interval_low, stats.interval_high}; }

void fill_costs(const json& report, Row& row) {
  row.parameters = report["parameters"].dump();
  row.rays = report["rays"];
  row.peak_memory_bytes = report["peak_memory_bytes"];
  row.artifact_bytes = report["result"]["bytes"];
  row.triangles = report["result"]["triangles"];
  row.vertices = report["result"]["vertices"];
  const json& certificate = report["certificate"];
  row.certified = {certificate["relrmse"], certificate["interval"][0], certificate["interval"][1]};
}

void fill_prediction(const json& prediction, Row& row) {
  row.predicted_seconds = prediction["seconds"];
  row.predicted_rays = prediction["rays"];
  row.predicted_memory_bytes = prediction["memory_bytes"];
  row.predicted_bytes = prediction["artifact_bytes"];
  row.predicted_vertices = prediction["vertices"];
}

/// At other points than the bake's own certificate, with other paths.
Result<void> fill_errors(const BakeInput& input, const Bytes& glb, const RunOptions& options, Row& row,
                         Threads& threads) {
  KILN_TRY(scene, import_scene(input.scene));
  KILN_TRY(decoded, read_baked_glb(glb));
  KILN_TRY(light, job_light(input));
  const Tracer truth(scene, threads);
  const Certificate found = certify(decoded, truth, light, {.thorough = options.thorough, .seed = kOtherSeed}, threads);
  row.all = error_of(found.transport);
  row.seen = error_of(found.seen ? *found.seen : found.transport);
  row.job_light = error_of(found.job_light ? *found.job_light : found.transport);
  return {};
}

Result<Row> bake_and_measure(const TradeScene& scene, Row row, const RunOptions& options) {
  const BakeInput input{scene.files, *parse_recipe(row.recipe), {}, {}};
  Threads threads;
  row.threads = threads.count();
  const double wall = bench::wall_seconds(), cpu = bench::process_seconds();
  KILN_TRY(output, bake(input, {}, threads));
  row.seconds = bench::wall_seconds() - wall;
  row.cpu_seconds = bench::process_seconds() - cpu;
  fill_costs(json::parse(file(output, "report.json")), row);
  KILN_TRY(plan, plan_json(input, threads));
  fill_prediction(json::parse(plan)["prediction"], row);
  if (auto errors = fill_errors(input, file(output, "scene.glb"), options, row, threads); !errors)
    return tl::make_unexpected(errors.error());
  return row;
}

}  // namespace

Result<Row> planned_row(const TradeScene& scene, const std::string& setting, const std::string& recipe) {
  const auto parsed = parse_recipe(recipe);
  if (!parsed)
    return fault("bad_recipe", setting + ": " + parsed.error().front().pointer + " " + parsed.error().front().detail);
  Row row;
  row.engine = kEngineVersion;
  row.scene = scene.name;
  row.scene_sha256 = sha256_hex(scene.files.main);
  row.setting = setting;
  row.recipe = recipe_identity(*parsed);
  return row;
}

Result<Row> run(const TradeScene& scene, const Row& planned, const RunOptions& options) {
  const auto text = in_child([&]() -> Result<std::string> {
    KILN_TRY(row, bake_and_measure(scene, planned, options));
    return csv_line(fields_of(row)) + "\n";
  });
  if (!text) return tl::make_unexpected(text.error());
  return row_of(parse_csv(*text).front());
}

Result<std::uint64_t> count_triangles(const TradeScene& scene) {
  const auto text = in_child([&]() -> Result<std::string> {
    KILN_TRY(imported, import_scene(scene.files));
    return std::to_string(imported.mesh.triangles.size());
  });
  if (!text) return tl::make_unexpected(text.error());
  return std::stoull(*text);
}

}  // namespace kiln::trade
