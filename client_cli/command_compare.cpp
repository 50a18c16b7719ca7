// kiln compare A B: the error of one table of values or artefact against another; --max-error makes it a gate.
#include <algorithm>

#include "client_cli/commands.h"
#include "client_cli/comparison.h"
#include "client_cli/files.h"
#include "client_cli/light_lookup.h"
#include "client_cli/models.h"
#include "client_cli/recipe_input.h"

namespace kiln {
namespace {

/// One side of a comparison: values that stand in a file, or an artefact that gives them at any points.
struct Side {
  std::optional<ValueTable> table;
  std::optional<BakedScene> baked;
};

Outcome<Side> load_side(const std::string& path) {
  KILN_TRY(bytes, read_file(path));
  Side side;
  if (kind_of(bytes) == FileKind::artefact) {
    KILN_TRY(baked, load_artefact(path));
    side.baked = std::move(baked);
    return side;
  }
  if (kind_of(bytes) == FileKind::grid)
    return fail(ExitCode::usage, "grid_needs_points", "is a grid: compare what `kiln eval` makes of it", path);
  if (kind_of(bytes) == FileKind::scene)
    return fail(ExitCode::rejected, "not_an_artefact", "is a scene without baked light", path);
  KILN_TRY(table, read_values(path));
  side.table = std::move(table);
  return side;
}

/// The light under which artefacts are compared: --env, or what A was baked with.
BakedLight common_light(const BakedScene& baked, const BakedScene& first,
                        const std::optional<Environment>& environment) {
  if (baked.transfer.order == 0) return {};  // radiosity has its own light
  if (environment) return baked_light(*environment, baked.transfer.order);
  BakedLight light = first.light;  // bands are independent: fewer or more of them
  for (std::vector<Vec3f>* part : {&light.coefficients, &light.bright}) {
    if (!part->empty()) part->resize(static_cast<std::size_t>(sh_count(baked.transfer.order)));
  }
  return light;
}

ValueTable values_at(const BakedScene& baked, const std::vector<QueryPoint>& points, const BakedLight& light,
                     bool scene_albedo, Threads& threads) {
  const Places places = place_points(baked.scene, points, threads);
  return {points, artefact_values(baked, places, light.parts(), {scene_albedo, points}), false};
}

/// Both sides as tables over the same points: those of a table if there is one, else points drawn on A.
void fill_tables(Side& a, Side& b, const std::optional<Environment>& environment, const CompareOptions& options,
                 Threads& threads) {
  const BakedScene* first = a.baked ? &*a.baked : b.baked ? &*b.baked : nullptr;
  if (!first) return;
  const std::vector<QueryPoint> points = a.table   ? a.table->points
                                         : b.table ? b.table->points
                                                   : draw_points(first->scene, {options.count, options.seed});
  for (Side* side : {&a, &b}) {
    if (side->baked)
      side->table = values_at(*side->baked, points, common_light(*side->baked, *first, environment),
                              options.scene_albedo, threads);
  }
}

}  // namespace

Outcome<ExitCode> run(const CompareOptions& options, Session& session) {
  KILN_TRY(a, load_side(options.a));
  KILN_TRY(b, load_side(options.b));
  KILN_TRY(environment, load_light(options.light));
  Threads threads;
  const StopTogether together(session.interrupt, threads);
  fill_tables(a, b, environment, options, threads);
  KILN_TRY(comparison, compare_values(*a.table, *b.table, options.column, options.seed));
  const Outcome<void> written =
      write_text("", session.common.json ? comparison_json(comparison) : comparison_text(comparison));
  if (!written) return tl::make_unexpected(written.error());
  if (!options.max_error || comparison.stats.relrmse <= *options.max_error) return ExitCode::ok;
  return fail(ExitCode::target_missed, "error_above_limit", "the error is above --max-error");
}

}  // namespace kiln
