#include "core/grid/refine.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

#include "core/base/random.h"
#include "core/grid/surface_gather.h"
#include "core/mesh/topology.h"
#include "core/meshless/direct_light.h"
#include "core/meshless/points.h"
#include "core/prt/hidden.h"
#include "core/prt/ray_origin.h"
#include "core/trace/surface.h"
#include "core/trace/surface_samples.h"

namespace kiln {
namespace {

constexpr double kPerFace = 4;
constexpr double kLeft = 0.5;
constexpr std::size_t kBlock = 64, kMostPlaces = std::size_t{1} << 21;
constexpr std::uint64_t kSeed = 0x726566696e65;

/// The lattice that answers for a place: 0 is the base.
std::size_t answering(const Grid& grid, const Vec3d& position) {
  std::size_t k = grid.finer.size();
  while (k > 0 && !grid.finer[k - 1].lattice.holds(place_in(grid.finer[k - 1].lattice, position).cell)) --k;
  return k;
}

/// Equation 1 at a place.
struct Found {
  std::size_t lattice = 0;  // that should answer for it
  std::uint32_t block = 0;
  double square = 0, light = 0, weight = 0;
};

class Measure {
 public:
  Measure(const SphereGather::World& world, const GridBake& params, const Grid& grid)
      : world_(world),
        grid_(grid),
        hidden_(hidden_test(world.tracer)),
        first_(world, params.rays / 4, mix64(params.seed ^ kSeed)),
        second_(world, params.rays / 4, mix64(params.seed ^ kSeed) + 1) {
    if (params.content == GridContent::all) direct_.emplace(world.tracer, world.sky, DirectRays{}.rough());
    for (std::size_t k = 0; k <= grid.finer.size(); ++k) next_.push_back(finer_lattice(grid.lattice, k));
  }

  const Lattice& next(std::size_t k) const { return next_[k]; }

  /// Nothing where the place is left out, as all but one of 4^k places are for a lattice that is k times twice as
  /// coarse as the finest.
  std::optional<Found> at(const SurfaceSample& s, std::size_t item, std::uint64_t& rays) const {
    const Scene& scene = world_.tracer.scene();
    SurfacePoint p = surface_point(scene, s.triangle, s.u, s.v);
    const Vec3d position = to_double(p.position);
    const std::size_t lattice = answering(grid_, position), coarser = 2 * (grid_.finer.size() - lattice);
    const std::size_t step = std::size_t{1} << coarser;
    if (item % step != 0) return std::nullopt;
    if (dot(p.normal, p.geometric_normal) < 0) p.geometric_normal = -p.geometric_normal;
    if (hidden_({p.position, p.normal, p.position, p.geometric_normal})) return std::nullopt;
    const Receiver place{offset_origin(p.position, p.geometric_normal), p.normal};
    Vec3f a = first_.at(place, item, rays), b = second_.at(place, item, rays);
    if (direct_) {
      a += direct_->at(place, 2 * item, rays) * std::numbers::pi_v<float>;
      b += direct_->at(place, 2 * item + 1, rays) * std::numbers::pi_v<float>;
    }
    const Vec3f g = irradiance_at(grid_, position, p.normal);
    const auto& n = blocks_along(next_[lattice]);
    const std::array<int, 3> block = next_[lattice].block_of(place_in(next_[lattice], position).cell);
    Found out{.lattice = lattice, .block = static_cast<std::uint32_t>((block[2] * n[1] + block[1]) * n[0] + block[0])};
    out.weight = static_cast<double>(step);
    out.square = out.weight * double{dot(a - g, b - g)} / 3;
    out.light = out.weight * double{a.x + a.y + a.z + b.x + b.y + b.z} / 6;
    return out;
  }

 private:
  const SphereGather::World& world_;
  const Grid& grid_;
  HiddenTest hidden_;
  SurfaceGather first_, second_;
  std::optional<DirectLight> direct_;
  std::vector<Lattice> next_;  // [lattice that answered]
};

}  // namespace

BricksWanted find_bricks(const SphereGather::World& world, const GridBake& params, const GridRefinement& asked,
                         const Grid& grid, Threads& threads) {
  const Mesh& mesh = world.tracer.scene().mesh;
  const Measure measure(world, params, grid);
  const Lattice& finest = grid.finer.empty() ? grid.lattice : grid.finer.back().lattice;
  const double faces = surface_area(mesh) / smallest_face(finest);
  const auto count = static_cast<std::size_t>(std::min(double{kMostPlaces}, std::ceil(kPerFace * faces)));
  const std::vector<SurfaceSample> samples = sample_surface(mesh, count, mix64(params.seed ^ kSeed));
  std::vector<std::vector<Found>> found((samples.size() + kBlock - 1) / kBlock);
  std::vector<std::uint64_t> rays(found.size());
  threads.for_blocks(samples.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (const auto here = measure.at(samples[i], i, rays[begin / kBlock])) found[begin / kBlock].push_back(*here);
    }
  });

  BricksWanted out;
  std::map<std::pair<std::size_t, std::uint32_t>, double> squares;
  double square = 0, light = 0, weight = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    out.rays += rays[i];
    for (const Found& f : found[i]) {
      squares[{f.lattice, f.block}] += f.square;
      square += f.square, light += f.light, weight += f.weight;
    }
  }
  for (const Grid& g : grid.finer) out.blocks.push_back(g.lattice.bricks.block);
  if (!(light > 0)) return out;
  out.error = std::sqrt(std::max(0.0, square / weight)) / (light / weight);
  std::vector<std::pair<double, std::pair<std::size_t, std::uint32_t>>> order;
  for (const auto& [block, sum] : squares) order.emplace_back(-sum, block);
  std::sort(order.begin(), order.end());
  const double enough = kLeft * std::pow(asked.error * light / weight, 2) * weight;
  std::size_t vertices = counts_of(grid).vertices;
  for (const auto& [sum, block] : order) {
    if (square <= enough || sum >= 0 || vertices >= asked.most_vertices) break;
    if (block.first >= asked.most_finer) continue;
    if (out.blocks.size() <= block.first) out.blocks.resize(block.first + 1);
    out.blocks[block.first].push_back(block.second);
    square += sum;
    vertices += Bricks::kCells;  // and as many again where none is beside it
    ++out.fresh;
  }
  for (auto& blocks : out.blocks) std::sort(blocks.begin(), blocks.end());
  return out;
}

void add_bricks(const SphereGather::World& world, const GridBake& params, const BricksWanted& wanted, BakedGrid& baked,
                Threads& threads) {
  Grid& grid = baked.grid;
  for (std::size_t k = 0; k < wanted.blocks.size(); ++k) {
    if (k < grid.finer.size() && grid.finer[k].lattice.bricks.block == wanted.blocks[k]) continue;
    BakedGrid level = bake_lattice(world, params, in_bricks(finer_lattice(grid.lattice, k), wanted.blocks[k]), threads);
    if (grid.finer.size() <= k) grid.finer.resize(k + 1);
    grid.finer[k] = std::move(level.grid);
    baked.stats.rays += level.stats.rays;
    baked.stats.invalid += level.stats.invalid;
    baked.stats.moved += level.stats.moved;
  }
}

}  // namespace kiln
