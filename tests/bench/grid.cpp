// Irradiance vector grids of the reference scene against its indirect light (comb - dir), and the rate of gathering.
//   kiln_grid_bench [longest side] [rays]      default: 8, 16, 32, 64 with 512 rays
//   kiln_grid_bench rate [rays]                gathering at 64 along the longest side against the same rays in Embree
//                                              alone, in processor seconds, medians of five: Cornell and the dungeon
// One JSON line a case: relRMSE at the vertices by blend, corners and filter; seconds; rays; bytes.

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <string>

#include "core/grid/bake_grid.h"
#include "core/grid/cell_corners.h"
#include "core/grid/surface_gather.h"
#include "core/meshless/radiosity.h"
#include "core/prt/ray_origin.h"
#include "core/sphere/sampling.h"
#include "tests/bench/bench.h"
#include "tests/core/prt/reference_set.h"

namespace kiln::bench {
namespace {

using Clock = std::chrono::steady_clock;

double since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// The scene turned by an arbitrary angle about an arbitrary axis and scaled into the unit cube again.
Scene rotated(Scene scene) {
  const Vec3f axis = normalized(Vec3f{1, 2, 3});
  const float angle = 0.7F, c = std::cos(angle), s = std::sin(angle), shrink = 1 / std::numbers::sqrt3_v<float>;
  const auto turn = [&](const Vec3f& v) { return v * c + cross(axis, v) * s + axis * (dot(axis, v) * (1 - c)); };
  for (Vec3f& p : scene.mesh.position) p = turn(p) * shrink;
  for (Vec3f& n : scene.mesh.normal) n = normalized(turn(n));
  scene.frame.scale /= double{shrink};
  return scene;
}

struct Case {
  const char* name;
  const Tracer& tracer;
  const testing::ReferenceSet& set;
  const std::vector<Vec3f>& truth;
};

using Look = std::function<Vec3f(const Vec3f& position, const Vec3f& normal)>;

void report(const Case& c, const std::string& what, const std::string& more, const Look& look) {
  std::vector<Vec3f> values;
  const Mesh& mesh = c.tracer.scene().mesh;
  for (const std::uint32_t v : c.set.vertex)
    values.push_back(look(mesh.position[v], mesh.normal[v]) * std::numbers::inv_pi_v<float>);
  const testing::RelativeError error = testing::relative_error(values, c.truth);
  std::printf("{\"bench\":\"grid\",\"scene\":\"%s\",\"case\":\"%s\",\"relrmse\":%.5f,\"without_worst_1pct\":%.5f%s}\n",
              c.name, what.c_str(), error.all, error.without_worst, more.c_str());
  std::fflush(stdout);
}

/// Receivers in the open, of any direction, against rays of their own.
void run_open(const Case& c, const LitSurface& surface, const std::string& what, const Grid& grid) {
  const SurfaceGather gather({c.tracer, surface.faces(), &surface, nullptr}, 1024, 5);
  const Box box = box_of(c.tracer.scene().mesh);
  std::uint64_t rays = 0;
  std::vector<Vec3f> values, truth;
  for (std::uint64_t i = 0; i < 2000; ++i) {
    Random random(6, i);
    Vec3d p;
    for (std::size_t axis = 0; axis < 3; ++axis)
      p[axis] = box.low[axis] + (box.high[axis] - box.low[axis]) * random.uniform_double();
    const double x = random.uniform_double(), y = random.uniform_double();
    const Vec3f n = to_float(uniform_sphere(Vec2<double>{x, y}));
    truth.push_back(gather.at({to_float(p), n}, i, rays) * std::numbers::inv_pi_v<float>);
    values.push_back(irradiance_at(grid, p, n, GridPlace::room) * std::numbers::inv_pi_v<float>);
  }
  const testing::RelativeError error = testing::relative_error(values, truth);
  std::printf(
      "{\"bench\":\"grid\",\"scene\":\"%s\",\"case\":\"%s, receivers in the open\",\"relrmse\":%.5f,"
      "\"without_worst_1pct\":%.5f}\n",
      c.name, what.c_str(), error.all, error.without_worst);
}

void run(const Case& c, const LitSurface& surface, int longest, int rays, Threads& threads) {
  const Box box = box_of(c.tracer.scene().mesh);
  for (const GridBlend blend : {GridBlend::exact, GridBlend::paper}) {
    const auto start = Clock::now();
    const BakedGrid baked =
        bake_grid({c.tracer, surface.faces(), &surface, nullptr},
                  {.size = even_size(box.low, box.high, longest), .blend = blend, .rays = rays}, threads);
    const double seconds = since(start);
    const Grid& grid = baked.grid;
    const auto [x, y, z] = grid.lattice.size;
    char more[256];
    std::snprintf(more, sizeof more, ",\"size\":[%d,%d,%d],\"rays\":%llu,\"seconds\":%.3f,\"mrays_s\":%.2f", x, y, z,
                  static_cast<unsigned long long>(baked.stats.rays), seconds,
                  1e-6 * static_cast<double>(baked.stats.rays) / seconds);
    const std::string name = blend == GridBlend::exact ? "exact" : "paper texels";
    report(c, name + ", stored corners", more,
           [&](const Vec3f& p, const Vec3f& n) { return irradiance_at(grid, to_double(p), n); });
    run_open(c, surface, name, grid);
    if (blend == GridBlend::paper) continue;
    report(c, name + ", stored corners, cubic", "", [&](const Vec3f& p, const Vec3f& n) {
      return irradiance_at(grid, to_double(p), n, GridPlace::surface, GridFilter::cubic);
    });
    report(c, name + ", eighths of cells", "",
           [&](const Vec3f& p, const Vec3f& n) { return irradiance_at(grid, to_double(p), n, GridPlace::room); });
    report(c, name + ", all corners", "",
           [&](const Vec3f& p, const Vec3f& n) { return irradiance_at(grid, to_double(p), n, GridPlace::anywhere); });
    const std::vector<Vec3f> stands = gather_places(grid.lattice, c.tracer.scene(), threads);
    Grid own = grid;
    report(c, name + ", a ray to each corner", "", [&](const Vec3f& p, const Vec3f& n) {
      const CellPlace place = place_in(grid.lattice, to_double(p));
      const std::uint8_t bits = corners_seen(c.tracer, grid.lattice, stands, place, offset_origin(p, n));
      own.cells[grid.lattice.cell_index(place.cell)].surface.fill({.below = {.bits = bits}});
      return irradiance_at(own, to_double(p), n);
    });
  }
}

/// Without a lattice: gathered where it is looked at. What is left is the blend, the rays and the lit surface.
void run_floor(const Case& c, const LitSurface& surface, int rays) {
  const SphereGather gather({c.tracer, surface.faces(), &surface, nullptr}, GridContent::indirect, rays, 0);
  std::uint64_t sent = 0, item = 0;
  for (const float lift : {1e-4F, 2e-3F}) {
    report(c, "gathered at the place, lifted " + std::to_string(lift), "", [&](const Vec3f& p, const Vec3f& n) {
      return exact_irradiance(exact_parts(gather.at(p + n * lift, item++, sent).light), n);
    });
    report(c, "six vectors there, paper blend", "", [&](const Vec3f& p, const Vec3f& n) {
      return paper_irradiance(gather.at(p + n * lift, item++, sent).light, n);
    });
  }
}

/// The rays of some vertices alone, without looking at what they hit: what Embree could do at most. As many of each
/// vertex as `sent` says.
struct BareRays {
  const Tracer& tracer;
  const DirectionSets& sets;

  /// Returns how many were sent, and adds those that hit.
  std::uint64_t trace(const Vec3f& place, std::size_t vertex, std::uint64_t sent, float& found) const {
    Rays16 packet;
    Hits16 hits;
    packet.far.fill(kFar), packet.ox.fill(place.x), packet.oy.fill(place.y), packet.oz.fill(place.z);
    const LocalFrame frame = local_frame(sets, {0, 1, 0}, 1, vertex);
    const auto packets = std::min<std::uint64_t>(sent, static_cast<std::uint64_t>(sets.samples())) / kPacket;
    for (std::uint64_t k = 0; k < packets; ++k) {
      sets.turn(frame.set, static_cast<int>(k), frame.basis, packet);
      tracer.closest16(packet, hits);
      for (const std::uint32_t t : hits.triangle) found += t != kNoHit ? 1.0F : 0.0F;
    }
    return packets * kPacket;
  }
};

/// Rays and the processor seconds they took.
struct Spent {
  double rays = 0, seconds = 0;
  double rate() const { return 1e-6 * rays / seconds; }
};

/// Gathers every vertex and sends the same rays bare, in turns of a slab of vertices each, so that both meet the same
/// machine.
void run_rate(const char* name, const Tracer& tracer, const LitSurface& surface, const GridBake& params,
              Threads& threads) {
  constexpr std::size_t kSlab = 8192, kRounds = 5;
  const Box box = box_of(tracer.scene().mesh);
  const Lattice lattice = lattice_over(box.low, box.high, params.size);
  const std::vector<Vec3f> places = gather_places(lattice, tracer.scene(), threads);
  const SphereGather gather({tracer, surface.faces(), &surface, nullptr}, params.content, params.rays, params.seed);
  const DirectionSets sets(0, params.rays, 8, 1, 0, Spread::sphere);
  const BareRays bare{tracer, sets};
  std::vector<std::uint64_t> sent(places.size());
  std::vector<float> sums(places.size());  // so that nothing is left out as unused
  std::vector<double> ratios, ours, embree;
  for (std::size_t round = 0; round < kRounds; ++round) {
    std::array<Spent, 2> spent;
    for (std::size_t slab = 0; slab < places.size(); slab += kSlab) {
      const std::size_t count = std::min(kSlab, places.size() - slab);
      for (const std::size_t which : {std::size_t{0}, std::size_t{1}}) {
        std::atomic<std::uint64_t> rays = 0;
        const double start = process_seconds();
        threads.for_blocks(count, 32, [&](std::size_t begin, std::size_t end) {
          std::uint64_t own = 0;
          for (std::size_t v = slab + begin; v < slab + end; ++v) {
            if (which == 1) {
              own += bare.trace(places[v], v, sent[v], sums[v]);
              continue;
            }
            sent[v] = 0;
            sums[v] = gather.at(places[v], v, sent[v]).light.vector[0][0].x;
            own += sent[v];
          }
          rays += own;
        });
        spent[which].seconds += process_seconds() - start;
        spent[which].rays += static_cast<double>(rays);
      }
    }
    ours.push_back(spent[0].rate()), embree.push_back(spent[1].rate());
    ratios.push_back(spent[0].rate() / spent[1].rate());
  }
  std::printf(
      "{\"bench\":\"grid\",\"scene\":\"%s\",\"case\":\"rate\",\"vertices\":%zu,\"rays\":%d,\"embree_mrays_s\":%.2f,"
      "\"gather_mrays_s\":%.2f,\"ratio\":%.3f,\"lowest\":%.3f,\"highest\":%.3f}\n",
      name, places.size(), params.rays, median(embree), median(ours), median(ratios),
      *std::min_element(ratios.begin(), ratios.end()), *std::max_element(ratios.begin(), ratios.end()));
  std::fflush(stdout);
}

void run_rates(const testing::ReferenceSet& set, int rays, Threads& threads) {
  const auto rate = [&](const char* name, const Scene& scene) {
    const Tracer tracer(scene, threads);
    const RadiosityResult light = solve_radiosity(tracer, nullptr, {}, threads);
    const Box box = box_of(scene.mesh);
    run_rate(name, tracer, *light.surface, {.size = even_size(box.low, box.high, 64), .rays = rays}, threads);
  };
  rate("cornell", set.scene);
  if (const auto dungeon = testing::load_scene(KILN_SHARED, "scenes/dungeon-interior/level-dungeon.gltf"))
    rate("dungeon", *dungeon);
}

}  // namespace
}  // namespace kiln::bench

int main(int argc, char** argv) {
  using namespace kiln;
  using namespace kiln::bench;
  Threads threads(2);
  const auto set = testing::load_reference_set(KILN_SHARED, "cornell");
  if (!set) return std::fprintf(stderr, "shared/models/references is not there\n"), 1;
  std::vector<Vec3f> truth = set->values("cornell.comb");
  const std::vector<Vec3f> direct = set->values("cornell.dir");
  for (std::size_t i = 0; i < truth.size(); ++i) truth[i] -= direct[i];
  if (argc > 1 && std::string(argv[1]) == "rate")
    return run_rates(*set, argc > 2 ? std::atoi(argv[2]) : 256, threads), 0;
  std::vector<int> sides{8, 16, 32, 64};
  if (argc > 1) sides = {std::atoi(argv[1])};
  const int rays = argc > 2 ? std::atoi(argv[2]) : 512;
  for (const bool turned : {false, true}) {
    const Scene scene = turned ? rotated(set->scene) : set->scene;
    const Tracer tracer(scene, threads);
    const auto start = Clock::now();
    const RadiosityResult light = solve_radiosity(tracer, nullptr, {}, threads);
    std::fprintf(stderr, "radiosity %.2f s\n", since(start));
    const Case c{turned ? "cornell rotated" : "cornell", tracer, *set, truth};
    run_floor(c, *light.surface, rays);
    for (const int side : sides) run(c, *light.surface, side, rays, threads);
  }
}
