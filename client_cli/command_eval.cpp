// kiln eval FILE --points P.csv: light values from an artefact, decoded exactly as delivered.
#include "client_cli/commands.h"
#include "client_cli/light_lookup.h"
#include "client_cli/models.h"
#include "client_cli/recipe_input.h"
#include "client_cli/value_output.h"

namespace kiln {

Outcome<ExitCode> run(const EvalOptions& options, Session& session) {
  KILN_TRY(points, read_points(options.points));
  KILN_TRY(baked, load_artefact(options.file));
  KILN_TRY(environment, load_light(options.light));
  if (environment && baked.transfer.order == 0) {
    return fail(ExitCode::usage, "not_relightable", "holds the light of one job (radiosity): leave out --env",
                options.file);
  }
  std::vector<Vec3f> light =
      environment ? project_environment(*environment, baked.transfer.order) : baked.light.coefficients;
  if (options.sh_order > 0) {
    const auto kept = static_cast<std::size_t>(sh_count(options.sh_order));
    for (std::size_t i = kept; i < light.size(); ++i) light[i] = {};
  }
  if (!environment) {
    say(baked.transfer.order == 0 ? "the light of its job (radiosity)"
        : light.empty()           ? "the artefact's own lamps"
                                  : "the light it was baked with: " + baked.light.name);
  }
  Threads threads;
  const StopTogether together(session.interrupt, threads);
  const Places places = place_points(baked.scene, points, threads);
  ValueTable table{points, artefact_values(baked, places, light, {options.scene_albedo, points}), false};
  return write_values(table, baked.scene.frame.scale, options.output, session);
}

}  // namespace kiln
