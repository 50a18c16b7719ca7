#include "core/bake/grid_step.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/artifact/grid_exr.h"
#include "core/bake/radiosity_step.h"
#include "core/grid/surface_gather.h"
#include "core/prt/ray_origin.h"
#include "core/sphere/sampling.h"
#include "core/trace/surface.h"
#include "core/trace/surface_samples.h"

namespace kiln {
namespace {

/// What the qualities spend. Measured on the Cornell reference: README.md of core/grid.
struct GridEffort {
  const char* reason;
  int longest;  // vertices along the longest side
  int rays;     // of a vertex
};

GridEffort grid_effort(const Recipe& recipe) {
  if (recipe.promise)
    return {"the first pass", kFirstLongest, recipe.promise.target_error.value_or(0) < 0.03 ? 1024 : 512};
  switch (recipe.quality) {
    case Quality::draft:
      return {"the draft quality", 16, 256};
    case Quality::standard:
      return {"the standard quality", 32, 512};
    case Quality::finest:
      break;
  }
  return {"the final quality", 64, 1024};
}

std::string text_of(const std::array<int, 3>& size) {
  return std::to_string(size[0]) + " x " + std::to_string(size[1]) + " x " + std::to_string(size[2]);
}

std::string percent(double x) {
  char out[32];
  std::snprintf(out, sizeof out, "%.2g %%", 100 * x);
  return out;
}

double vertices_of(const std::array<int, 3>& size) { return double(size[0]) * size[1] * size[2]; }

std::uint64_t whole(double x) { return static_cast<std::uint64_t>(std::min(x, 1e18)); }

/// How far rays see: the median distance of cosine rays from points all over the surface, in lengths of the unit cube.
double median_reach(const Tracer& tracer) {
  constexpr std::size_t kPoints = 512;
  std::vector<float> reach;
  for (const SurfaceSample& s : sample_surface(tracer.scene().mesh, kPoints, 0x7265616368)) {
    const SurfacePoint p = surface_point(tracer.scene(), s.triangle, s.u, s.v);
    const Basis<float> basis = basis_around(p.normal);
    const Vec3f from = offset_origin(p.position, p.geometric_normal);
    for (std::uint32_t k = 0; k < 8; ++k) {
      const Vec3f w = normalized(basis.to_world(cosine_hemisphere(sobol_owen(k, s.triangle))));
      const Hit hit = tracer.closest(from, w, kFar);
      reach.push_back(hit ? hit.t : kFar);
    }
  }
  if (reach.empty()) return kFar;
  const auto middle = reach.begin() + static_cast<std::ptrdiff_t>(reach.size() / 2);
  std::nth_element(reach.begin(), middle, reach.end());
  return *middle;
}

/// A scene of many rooms needs the vertices of each: in a single one rays reach about half of its side. At most
/// kMostRooms times as many along a side, for time and memory.
int longest_side(const GridEffort& effort, double reach) {
  constexpr double kRoomReach = 0.5, kMostRooms = 4;
  return static_cast<int>(effort.longest * std::clamp(kRoomReach / std::max(reach, 1e-6), 1.0, kMostRooms));
}

/// Seconds of one ray of a gather: some of the planned ones, sent from all over the lattice. What they would read where
/// they land costs as much again (kiln_grid_bench).
double seconds_a_ray(const Tracer& tracer, const GridBake& bake, Threads& threads) {
  constexpr std::size_t kVertices = 64;
  constexpr double kReading = 2;
  const Box box = box_of(tracer.scene().mesh);
  const Lattice lattice = lattice_over(box.low, box.high, bake.size);
  const GatherFaces faces(tracer.scene());
  const SphereGather gather({tracer, faces}, bake.content, 256, 1);
  std::vector<std::uint64_t> rays(kVertices);
  const auto start = std::chrono::steady_clock::now();
  threads.for_blocks(kVertices, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t v = i * lattice.vertices() / kVertices;
      gather.at(to_float(lattice.position(lattice.vertex(v))), v, rays[i]);
    }
  });
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  double sent = 0;
  for (const std::uint64_t n : rays) sent += static_cast<double>(n);
  return kReading * seconds / std::max(1.0, sent);
}

/// Faces of cells along the surface: a room has about twice the walls of its box.
double faces_of(const GridBake& bake) {
  const auto& [x, y, z] = bake.size;
  return 4.0 * (double(x) * y + double(y) * z + double(z) * x);
}

/// Places that the grid is fitted to.
double places_of(const GridBake& bake) { return fits_surface(bake) ? SurfacePlaces{}.per_face * faces_of(bake) : 0; }

/// Rays from the surface. Shadow rays of cell_corners.h: 16 points to a cell's face, 128 along edges, and one a
/// triangle ask for eight corners each; of the cells a surface crosses each asks for 64. Then those of the places.
double surface_rays(const Prediction& mesh, const GridBake& bake) {
  const auto& [x, y, z] = bake.size;
  const double faces = faces_of(bake), edges = 16.0 * (double(x) + y + z);
  const double votes = 16 * faces + 128 * edges + static_cast<double>(mesh.triangles);
  return 8 * votes + 64 * faces + places_of(bake) * bake.rays / 2;
}

/// Adds a grid of one size to a prediction. Bytes and memory by vertices, as measured by grid_bake_test.
void add_prediction(Prediction& out, const GridBake& bake, double price) {
  const double vertices = vertices_of(bake.size), numbers = 3 * static_cast<double>(part_count(bake.blend));
  const double rays = vertices * bake.rays;
  out.rays += whole(rays + surface_rays(out, bake));
  out.seconds += price * (rays + surface_rays(out, bake)) + 2e-6 * vertices;
  out.memory_bytes += whole(vertices * (16 * numbers + 64) + 220 * places_of(bake));
  out.artifact_bytes += whole(6000 + vertices * (1.75 * numbers + 2));
}

/// One grid: gathered, written, read back, certified. Replaces what `out` holds of the one before.
Result<GridPass> bake_once(const GridTask& task, const GridBake& params, int bounces, double share, GridOutcome& out,
                           BakeLog& log, Threads& threads) {
  const double before = log.seconds();
  log.begin("grid " + text_of(params.size), share);
  const BakedGrid baked = bake_grid(task.world, params, threads);
  out.file = write_grid_exr(baked.grid, task.world.tracer.scene().frame, task.provenance);
  KILN_TRY(decoded, read_grid_exr(out.file, "grid.exr"));
  log.count_rays(baked.stats.rays);
  out.size = params.size;
  out.rays = params.rays;
  out.spacing = decoded.lattice.spacing;
  out.stats = baked.stats;
  GridPass pass{.size = params.size, .rays = baked.stats.rays};
  if (task.recipe.certificate) {
    log.begin("grid certificate", share + 0.02);
    // A quick look tells that a target is far; what says that it is met has to be thorough.
    const auto certify = [&](bool thorough) {
      out.certificate = certify_grid({decoded, baked, task.world, params, bounces, thorough}, threads);
    };
    certify(false);
    if (out.certificate->error.relrmse <= task.recipe.promise.target_error.value_or(0)) certify(true);
    const ErrorStats& error = out.certificate->error;
    pass.relrmse = error.relrmse, pass.low = error.interval_low, pass.high = error.interval_high;
    log.know_error(error.relrmse);
  }
  pass.seconds = log.seconds() - before;
  return pass;
}

/// Why there is no further pass, or nothing where there is one. `seconds` is what the whole bake has taken so far.
struct Ending {
  bool kept = false;
  std::string ended_by, reason;
};

std::optional<Ending> ending_of(const Recipe& recipe, const GridPass& last, const std::array<int, 3>& next,
                                std::uint64_t next_memory, double seconds) {
  const Promise& promise = recipe.promise;
  const std::string reached =
      "the grid of " + text_of(last.size) + " vertices has an error of at most " + percent(last.high);
  if (promise.target_error && last.high <= *promise.target_error) return Ending{true, "target_met", reached};
  const double then = seconds + last.seconds * vertices_of(next) / vertices_of(last.size);
  if (promise.time_budget_s && then > *promise.time_budget_s)
    return Ending{true, "time_spent", reached + "; the next finer one would not fit the time"};
  const bool kept = !promise.target_error;
  if (then > recipe.limits.wall_s)
    return Ending{kept, "floor", reached + "; the next finer one would not fit limits.wall_s"};
  if (*std::max_element(next.begin(), next.end()) > kMostLongest)
    return Ending{kept, "floor", reached + "; finer ones are not baked"};
  if (next_memory > recipe.limits.memory_mb << 20)
    return Ending{kept, "floor", reached + "; the next finer one would not fit limits.memory_mb"};
  return std::nullopt;
}

}  // namespace

Plan make_grid_plan(const Scene& scene, const Recipe& recipe, const Environment* sky, Threads& threads) {
  const GridStep& step = *recipe.grid;
  const Quality surface = recipe.promise ? Quality::standard : recipe.quality;
  Plan plan = make_radiosity_plan(scene, {.bounces = step.bounces}, radiosity_effort(surface), sky, threads);
  const GridEffort effort = grid_effort(recipe);
  const Box box = box_of(scene.mesh);
  const Tracer tracer(scene, threads);
  const double reach = median_reach(tracer);
  const int longest = recipe.promise ? effort.longest : longest_side(effort, reach);
  plan.grid = GridBake{.size = step.resolution.value_or(even_size(box.low, box.high, longest)),
                       .blend = step.blend,
                       .content = step.content,
                       .rays = step.samples.value_or(effort.rays)};
  const GridBake& grid = *plan.grid;
  const std::string asked = "asked for by the recipe";
  std::string reason = effort.reason + std::string(" has ") + std::to_string(effort.longest) +
                       " vertices along the side of a room; half of the rays that leave a surface end within " +
                       percent(reach) + " of the scene's longest side";
  if (recipe.promise) reason = "the first pass; doubled until the promise is kept";
  decide(plan, "resolution", text_of(grid.size), step.resolution ? asked : reason);
  decide(plan, "content", step.content == GridContent::all ? "all" : "indirect",
         step.content == GridContent::all ? "lamps and sky are in the grid too"
                                          : "direct light is left to the renderer, which knows it sharper");
  decide(plan, "blend", step.blend == GridBlend::exact ? "exact" : "paper",
         step.blend == GridBlend::exact
             ? "right for light of three SH bands, in 54 bytes a vertex"
             : "as in the paper, in 72 bytes a vertex: constant light comes back as little as .577");
  decide(plan, "grid rays", std::to_string(grid.rays), step.samples ? asked : effort.reason);
  if (step.bounces == 0 && step.content == GridContent::indirect)
    decide(plan, "grid light", "none", "no reflections were asked for, and direct light is not in this grid");
  add_prediction(plan.prediction, grid, seconds_a_ray(tracer, grid, threads));
  return plan;
}

Result<GridOutcome> bake_grid_step(const GridTask& task, Plan& plan, BakeLog& log, Threads& threads) {
  GridOutcome out;
  const Box box = box_of(task.world.tracer.scene().mesh);
  GridBake params = *plan.grid;
  params.seed = task.recipe.seed;
  params.progress = [&](std::uint64_t done, std::uint64_t total) { log.advance(done, total); };
  double share = 0.6;
  for (int longest = kFirstLongest;; longest *= 2) {
    KILN_TRY(pass, bake_once(task, params, plan.radiosity->bounces, share, out, log, threads));
    out.passes.push_back(pass);
    if (!task.recipe.promise) break;
    GridBake finer = params;
    finer.size = even_size(box.low, box.high, 2 * longest);
    Prediction more;
    add_prediction(more, finer, 0);
    if (const auto ending = ending_of(task.recipe, pass, finer.size, more.memory_bytes, log.seconds())) {
      out.kept = ending->kept, out.ended_by = ending->ended_by, out.reason = ending->reason;
      break;
    }
    params = finer;
    share += 0.5 * (0.85 - share);
  }
  plan.grid->size = params.size;
  decide(plan, "grid vertices",
         std::to_string(out.stats.invalid) + " inside solids, " + std::to_string(out.stats.moved) + " moved",
         "those inside are filled from their neighbours, those on a surface gather beside it");
  return out;
}

}  // namespace kiln
