// kiln points IN --count N: points uniform by area on a scene or artefact, for eval and reference.
#include "client_cli/commands.h"
#include "client_cli/files.h"
#include "client_cli/light_lookup.h"
#include "client_cli/models.h"
#include "core/artifact/eye.h"

namespace kiln {
namespace {

struct Surface {
  Scene scene;
  std::vector<double> density;  // of its triangles; empty: all alike
};

/// The surface as delivered where the file is an artefact, else the scene as imported.
Outcome<Surface> surface_of(const PointsOptions& options) {
  KILN_TRY(bytes, read_file(options.input));
  if (kind_of(bytes) != FileKind::artefact) {
    if (options.specular)
      return fail(ExitCode::usage, "not_an_artefact", "is no artefact: --specular asks for its matrices",
                  options.input);
    KILN_TRY(scene, load_scene(options.input));
    return Surface{std::move(scene), {}};
  }
  KILN_TRY(baked, load_artefact(options.input));
  Surface out;
  for (const Triangle& t : baked.scene.mesh.triangles) {
    if (options.specular) out.density.push_back(has_matrices(baked.glossy, t) ? 1 : 0);
  }
  out.scene = std::move(baked.scene);
  return out;
}

}  // namespace

Outcome<ExitCode> run(const PointsOptions& options, Session& session) {
  KILN_TRY(surface, surface_of(options));
  const auto points = draw_points(surface.scene, {options.count, options.seed, options.views, surface.density});
  if (points.empty() && options.count > 0) {
    return fail(ExitCode::rejected, "no_surface",
                options.specular ? "has no triangle with matrices" : "has no triangle with an area", options.input);
  }
  const Outcome<void> written =
      write_text(options.output, session.common.json ? points_json(points) : points_csv(points));
  if (!written) return tl::make_unexpected(written.error());
  return ExitCode::ok;
}

}  // namespace kiln
