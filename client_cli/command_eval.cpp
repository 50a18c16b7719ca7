// kiln eval FILE --points P.csv: light values from an artefact, decoded exactly as delivered.
#include "client_cli/commands.h"
#include "client_cli/files.h"
#include "client_cli/lamp.h"
#include "client_cli/light_lookup.h"
#include "client_cli/models.h"
#include "client_cli/recipe_input.h"
#include "client_cli/value_output.h"

namespace kiln {
namespace {

Outcome<ExitCode> run_grid(const EvalOptions& options, const std::vector<QueryPoint>& points, Session& session) {
  if (!options.light.name.empty() || options.scene_albedo) {
    return fail(ExitCode::usage, "not_relightable", "is a grid of one job's light: leave out --env and --albedo",
                options.file);
  }
  KILN_TRY(grid, load_grid(options.file));
  say(grid.content == GridContent::indirect ? "reflected light of its job (a grid holds no direct light)"
                                            : "all light of its job");
  return write_values({points, grid_values(grid, points), false}, 1, options.output, session);
}

Outcome<ExitCode> run_lamp(const EvalOptions& options, const std::vector<QueryPoint>& points, const Bytes& bytes,
                           Session& session) {
  KILN_TRY(lamp, parse_lamp(options.lamp));
  KILN_TRY(baked, load_artefact(options.file));
  KILN_TRY(links, or_failure(read_links(bytes, baked)));
  if (links.vertices() == 0) {
    return fail(ExitCode::usage, "no_links", "has no links for lights that move (step transport): leave out --light",
                options.file);
  }
  say(options.indirect ? "reflected light of the lamp" : "the lamp: direct light by rays, reflected light by links");
  Threads threads;
  const StopTogether together(session.interrupt, threads);
  const Places places = place_points(baked.scene, points, threads);
  const double scale = baked.scene.frame.scale;
  const LampLookup lookup{lamp, options.indirect, {options.scene_albedo, points}};
  ValueTable table{points, lamp_values(std::move(baked), links, places, lookup, threads), false};
  return write_values(table, scale, options.output, session);
}

/// The light that an artefact of one job shows: the vertices', or the lightmap's where that is asked for.
Outcome<void> choose_lightmap(const EvalOptions& options, const Bytes& bytes, BakedScene& baked) {
  KILN_TRY(map, or_failure(read_lightmap(bytes)));
  if (options.lightmap && map.side == 0)
    return fail(ExitCode::usage, "no_lightmap", "has no lightmap: leave out --lightmap", options.file);
  if (map.side > 0)
    say(options.lightmap ? "its lightmap, as the 8-bit image in the file has it"
                         : "its vertices, not its lightmap: that is --lightmap");
  if (options.lightmap) baked.lightmap = std::move(map);
  return {};
}

}  // namespace

Outcome<ExitCode> run(const EvalOptions& options, Session& session) {
  KILN_TRY(points, read_points(options.points));
  KILN_TRY(bytes, read_file(options.file));
  if (kind_of(bytes) == FileKind::grid) return run_grid(options, points, session);
  if (!options.lamp.empty()) return run_lamp(options, points, bytes, session);
  if (options.indirect) return fail(ExitCode::usage, "indirect_of_what", "only goes with --light", "--indirect");
  KILN_TRY(baked, load_artefact(options.file));
  KILN_TRY(environment, load_light(options.light));
  if (environment && baked.transfer.order == 0) {
    return fail(ExitCode::usage, "not_relightable", "holds the light of one job (radiosity): leave out --env",
                options.file);
  }
  BakedLight light = environment ? baked_light(*environment, baked.transfer.order) : baked.light;
  if (options.sh_order > 0) {
    const auto kept = static_cast<std::size_t>(sh_count(options.sh_order));
    for (std::size_t i = kept; i < light.coefficients.size(); ++i) light.coefficients[i] = {};
    for (std::size_t i = kept; i < light.bright.size(); ++i) light.bright[i] = {};
  }
  if (!environment) {
    say(baked.transfer.order == 0    ? "the light of its job (radiosity)"
        : light.coefficients.empty() ? "the artefact's own lamps"
                                     : "the light it was baked with: " + baked.light.name);
  }
  const Outcome<void> chosen = choose_lightmap(options, bytes, baked);
  if (!chosen) return tl::make_unexpected(chosen.error());
  Threads threads;
  const StopTogether together(session.interrupt, threads);
  const Places places = place_points(baked.scene, points, threads);
  ValueTable table{points, artefact_values(baked, places, light.parts(), {options.scene_albedo, points}), false};
  return write_values(table, baked.scene.frame.scale, options.output, session);
}

}  // namespace kiln
