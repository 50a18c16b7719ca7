// kiln points IN --count N: points uniform by area on a scene or artefact, for eval and reference.
#include "client_cli/commands.h"
#include "client_cli/files.h"
#include "client_cli/light_lookup.h"
#include "client_cli/models.h"

namespace kiln {
namespace {

/// The surface as delivered where the file is an artefact, else the scene as imported.
Outcome<Scene> surface_of(const std::string& path) {
  KILN_TRY(bytes, read_file(path));
  if (kind_of(bytes) != FileKind::artefact) return load_scene(path);
  KILN_TRY(baked, load_artefact(path));
  return std::move(baked.scene);
}

}  // namespace

Outcome<ExitCode> run(const PointsOptions& options, Session& session) {
  KILN_TRY(scene, surface_of(options.input));
  const auto points = draw_points(scene, options.count, options.seed);
  if (points.empty() && options.count > 0)
    return fail(ExitCode::rejected, "no_surface", "has no triangle with an area", options.input);
  const Outcome<void> written =
      write_text(options.output, session.common.json ? points_json(points) : points_csv(points));
  if (!written) return tl::make_unexpected(written.error());
  return ExitCode::ok;
}

}  // namespace kiln
