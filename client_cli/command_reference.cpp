// kiln reference IN --points P.csv: the path-traced truth at points of a scene, with its standard error.
#include "client_cli/commands.h"
#include "client_cli/lamp.h"
#include "client_cli/light_lookup.h"
#include "client_cli/models.h"
#include "client_cli/recipe_input.h"
#include "client_cli/value_output.h"

namespace kiln {
namespace {

void show_warnings(const Scene& scene, const Terminal& terminal) {
  for (const Warning& warning : scene.warnings) {
    warn(terminal, (warning.where.empty() ? "" : warning.where + ": ") + warning.message + " [" + warning.code + "]");
  }
}

}  // namespace

Outcome<ExitCode> run(const TruthOptions& options, Session& session) {
  KILN_TRY(points, read_points(options.points));
  KILN_TRY(scene, load_scene(options.input));
  KILN_TRY(environment, load_light(options.light));
  show_warnings(scene, session.terminal);
  if (!options.lamp.empty()) {
    KILN_TRY(lamp, parse_lamp(options.lamp));
    light_only(scene, lamp);
  }
  if (!environment && scene.lights.empty()) say("no --env: only emitters of the scene give light");
  Threads threads(options.threads);
  const StopTogether together(session.interrupt, threads);
  const Places places = place_points(scene, points, threads);
  const TraceOptions trace{.samples = options.samples,
                           .bounces = options.bounces,
                           .from = options.indirect ? 1 : 0,
                           .sh_order = options.sh_order,
                           .seed = options.seed,
                           .highlights = options.highlights,
                           .look = {options.scene_albedo, points}};
  ValueTable table{points, traced_values(scene, places, environment, trace, threads), true};
  return write_values(table, scene.frame.scale, options.output, session);
}

}  // namespace kiln
