// Where a grid of a scene under the clear sky is wrong, and what bricks mend.
//   kiln_grid_bricks SCENE [longest side] [rays] [passes] [points of the surface's light]
// SCENE is a path below shared/models; its punctual lights are left out. One JSON line a case, at 3000 random places of
// the surface against 512 paths: gathered at the places themselves, the base, and after each pass of bricks.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>

#include "core/grid/refine.h"
#include "core/grid/surface_gather.h"
#include "core/mesh/closest_point.h"
#include "core/mesh/topology.h"
#include "core/meshless/radiosity.h"
#include "core/prt/hidden.h"
#include "core/prt/ray_origin.h"
#include "core/trace/reference.h"
#include "core/trace/surface_samples.h"
#include "tests/bench/bench.h"
#include "tests/core/prt/reference_set.h"

namespace kiln::bench {
namespace {

std::vector<ReferencePoint> visible_places(const Tracer& tracer) {
  const Mesh& mesh = tracer.scene().mesh;
  const HiddenTest hidden = hidden_test(tracer);
  std::vector<ReferencePoint> out;
  for (const SurfaceSample& s : sample_surface(mesh, 3000, 77)) {
    const SurfaceMatch here{s.triangle, s.u, s.v, 0};
    const Vec3f position = to_float(match_position(mesh, here)), normal = to_float(match_normal(mesh, here));
    Vec3f face = normalized(area_vector(mesh, mesh.triangles[s.triangle]), normal);
    if (dot(face, normal) < 0) face = -face;
    if (!hidden({position, normal, position, face})) out.push_back({position, normal, face});
  }
  return out;
}

struct Truth {
  std::vector<Vec3d> value;
  std::vector<double> noise;  // variance, mean of the channels
  double mean = 0;
};

Truth truth_at(const Tracer& tracer, const Environment& sky, const std::vector<ReferencePoint>& places,
               Threads& threads) {
  const ReferenceResult r =
      trace_reference(tracer, places, {.environments = {sky}}, {.samples = 512, .from = 1, .seed = 5}, threads);
  Truth out{.value = r.value, .noise = {}};
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Vec3d apart = r.half_a[i] - r.half_b[i];
    out.noise.push_back(dot(apart, apart) / 12);
    out.mean += (r.value[i].x + r.value[i].y + r.value[i].z) / (3 * static_cast<double>(places.size()));
  }
  return out;
}

/// relRMSE of irradiance, all of it and without the worst 1 % of the places.
template <class F>
void report(const char* what, const Truth& truth, const Grid* grid, const F& irradiance) {
  std::vector<double> squares;
  for (std::size_t i = 0; i < truth.value.size(); ++i) {
    const Vec3d off = to_double(irradiance(i)) / std::numbers::pi - truth.value[i];
    squares.push_back(dot(off, off) / 3 - truth.noise[i]);
  }
  std::sort(squares.begin(), squares.end());
  double all = 0, most = 0;
  for (std::size_t i = 0; i < squares.size(); ++i) {
    all += squares[i];
    if (i < squares.size() - squares.size() / 100) most += squares[i];
  }
  const auto relative = [&](double sum) {
    return std::sqrt(std::max(0.0, sum / static_cast<double>(squares.size()))) / truth.mean;
  };
  const GridCounts counts = grid != nullptr ? counts_of(*grid) : GridCounts{};
  std::printf(
      "{\"bench\":\"grid bricks\",\"case\":\"%s\",\"relrmse\":%.3f,\"without_worst_1pct\":%.3f,\"vertices\":%zu,"
      "\"bricks\":%zu,\"processor_s\":%.1f}\n",
      what, relative(all), relative(most), counts.vertices, counts.bricks, process_seconds());
  std::fflush(stdout);
}

void run(const Scene& scene, const GridBake& asked, int longest, int passes, std::uint64_t points) {
  Threads threads(2);
  const Environment sky = clear_sky_with_sun();
  const Tracer tracer(scene, threads);
  const RadiosityResult light = solve_radiosity(tracer, &sky, {.points = {.wanted = points}}, threads);
  const std::vector<ReferencePoint> places = visible_places(tracer);
  const Truth truth = truth_at(tracer, sky, places, threads);
  const SphereGather::World world{tracer, light.surface->faces(), light.surface.get(), &sky};
  const SurfaceGather gather(world, 2048, 5);
  std::uint64_t rays = 0;
  report("gathered at the place", truth, nullptr, [&](std::size_t i) {
    return gather.at({offset_origin(places[i].position, places[i].face_normal), places[i].normal}, i, rays);
  });
  GridBake params = asked;
  const Box box = box_of(scene.mesh);
  params.size = even_size(box.low, box.high, longest);
  BakedGrid baked = bake_grid(world, params, threads);
  const auto read = [&](std::size_t i) {
    return irradiance_at(baked.grid, to_double(places[i].position), places[i].normal);
  };
  report("base", truth, &baked.grid, read);
  for (int pass = 0; pass < passes; ++pass) {
    add_bricks(world, params, find_bricks(world, params, {}, baked.grid, threads), baked, threads);
    report("bricks", truth, &baked.grid, read);
  }
}

}  // namespace
}  // namespace kiln::bench

int main(int argc, char** argv) {
  using namespace kiln;
  const auto number = [&](int at, int otherwise) { return argc > at ? std::atoi(argv[at]) : otherwise; };
  const auto loaded = testing::load_scene(KILN_SHARED, argc > 1 ? argv[1] : "");
  if (!loaded) return std::fprintf(stderr, "kiln_grid_bricks SCENE, a path below shared/models\n"), 1;
  Scene scene = *loaded;
  scene.lights.clear();
  bench::run(scene, {.rays = number(3, 256)}, number(2, 64), number(4, 2), static_cast<std::uint64_t>(number(5, 0)));
}
