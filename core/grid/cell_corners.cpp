#include "core/grid/cell_corners.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <span>

#include "core/base/random.h"
#include "core/mesh/topology.h"
#include "core/meshless/points.h"
#include "core/sphere/sampling.h"
#include "core/trace/surface.h"

namespace kiln {
namespace {

constexpr double kPerCell = 16;                  // points to the area of a cell's smallest face
constexpr std::uint64_t kMostPoints = 1U << 16;  // on one triangle
constexpr std::size_t kBlock = 256;
constexpr int kOpenWeight = 8;  // of places in the open: where they share a cell with the inside of a solid, which
                                // nobody sees, its darkness must not reach out from under it

/// One point of a surface: which corners its side sees.
struct Vote {
  std::uint64_t key = 0;  // cell x 6 + direction
  std::uint8_t seen = 0;
  int weight = 1;
  std::array<double, 3> fraction{};  // its place in the cell
};
using Votes = std::span<const Vote>;

double smallest_face(const Lattice& lattice) {
  const Vec3d& s = lattice.spacing;
  return std::min({s.x * s.y, s.y * s.z, s.z * s.x});
}

std::uint64_t points_on(double area, double face) {
  return static_cast<std::uint64_t>(std::clamp(std::ceil(kPerCell * area / face), 1.0, double{kMostPoints}));
}

class Voters {
 public:
  Voters(const Tracer& tracer, const Lattice& lattice, const std::vector<Vec3f>& stands)
      : tracer_(tracer), lattice_(lattice), stands_(stands), faces_(tracer.scene()), face_(smallest_face(lattice)) {}

  void add_votes_of(std::uint32_t triangle, std::vector<Vote>& votes) const {
    const Scene& scene = tracer_.scene();
    const std::uint64_t count = points_on(triangle_area(scene.mesh, scene.mesh.triangles[triangle]), face_);
    const Part& part = scene.parts[scene.mesh.part[triangle]];
    const bool both = scene.materials[static_cast<std::size_t>(part.material)].double_sided;
    for (std::uint64_t i = 0; i < count; ++i) {
      const Vec2f u = sobol_owen(static_cast<std::uint32_t>(i), mix64(triangle));
      const Vec2<double> at = uniform_triangle({u.x, u.y});
      const SurfacePoint p = surface_point(scene, triangle, static_cast<float>(at.x), static_cast<float>(at.y));
      votes.push_back(vote(p.position, p.normal, p.geometric_normal));
      if (both) votes.push_back(vote(p.position, -p.normal, -p.geometric_normal));
    }
  }

 private:
  Vote vote(const Vec3f& position, const Vec3f& normal, const Vec3f& face) const {
    const CellPlace place = place_in(lattice_, to_double(position));
    const std::uint8_t seen = corners_seen(tracer_, lattice_, stands_, place, offset_origin(position, face));
    const bool enclosed = is_enclosed(tracer_, faces_, {position, normal, position, face});
    return {.key = lattice_.cell_index(place.cell) * kDirections + nearest_direction(normal),
            .seen = seen,
            .weight = enclosed ? 1 : kOpenWeight,
            .fraction = place.fraction};
  }

  const Tracer& tracer_;
  const Lattice& lattice_;
  const std::vector<Vec3f>& stands_;
  GatherFaces faces_;
  double face_;
};

std::vector<Vote> surface_votes(const Tracer& tracer, const Lattice& lattice, const std::vector<Vec3f>& stands,
                                Threads& threads) {
  const Voters voters(tracer, lattice, stands);
  const std::size_t triangles = tracer.scene().mesh.triangles.size();
  std::vector<std::vector<Vote>> found((triangles + kBlock - 1) / kBlock);
  threads.for_blocks(triangles, kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) voters.add_votes_of(static_cast<std::uint32_t>(t), found[begin / kBlock]);
  });
  std::vector<Vote> votes;
  for (const auto& own : found) votes.insert(votes.end(), own.begin(), own.end());
  std::stable_sort(votes.begin(), votes.end(), [](const Vote& a, const Vote& b) { return a.key < b.key; });
  return votes;
}

constexpr int kCuts = 15;  // planes tried along each axis

/// How many votes see each corner.
struct Tally {
  std::array<int, 8> seen{};
  int votes = 0;

  void add(const Vote& v) {
    votes += v.weight;
    for (std::size_t k = 0; k < 8; ++k) seen[k] += (v.seen >> k & 1) * v.weight;
  }
  /// The corners that at least half of the votes see.
  std::uint8_t majority() const {
    unsigned bits = 0;
    for (std::size_t k = 0; k < 8; ++k) bits |= 2 * seen[k] >= votes && votes > 0 ? 1U << k : 0U;
    return static_cast<std::uint8_t>(bits);
  }
  int outvoted() const {
    int sum = 0;
    for (const int n : seen) sum += std::min(n, votes - n);
    return sum;
  }
};

CornerCut best_cut(Votes votes) {
  Tally all;
  for (const Vote& v : votes) all.add(v);
  CornerCut best{0, all.majority(), 0};
  int least = all.outvoted();
  for (std::size_t axis = 0; axis < 3 && least > 0; ++axis) {
    for (int k = 1; k <= kCuts; ++k) {
      const int place = 64 * k / (kCuts + 1);
      Tally below, above;
      for (const Vote& v : votes) (v.fraction[axis] >= place / 64.0 ? above : below).add(v);
      if (below.votes == 0 || above.votes == 0 || below.outvoted() + above.outvoted() >= least) continue;
      least = below.outvoted() + above.outvoted();
      best = {static_cast<std::uint8_t>(axis << 6 | static_cast<unsigned>(place)), below.majority(), above.majority()};
    }
  }
  return best;
}

/// Whether the plane of a triangle passes through a box, or within half a box of it.
bool plane_meets(const Vec3d& normal, const Vec3d& on_plane, const Vec3d& middle, const Vec3d& half) {
  const double reach = std::abs(normal.x) * half.x + std::abs(normal.y) * half.y + std::abs(normal.z) * half.z;
  return std::abs(dot(normal, middle - on_plane)) <= reach;
}

}  // namespace

std::uint8_t corners_seen(const Tracer& tracer, const Lattice& lattice, const std::vector<Vec3f>& stands,
                          const CellPlace& place, const Vec3f& from) {
  std::uint8_t bits = 0;
  Rays16 rays;
  rays.ox.fill(from.x), rays.oy.fill(from.y), rays.oz.fill(from.z);
  for (int k = 0; k < 8; ++k) {
    const Vec3f way = stands[lattice.index(lattice.corner(place.cell, k))] - from;
    const float distance = length(way);
    const Vec3f w = normalized(way);
    const auto i = static_cast<std::size_t>(k);
    rays.dx[i] = w.x, rays.dy[i] = w.y, rays.dz[i] = w.z, rays.far[i] = distance;
  }
  const std::uint32_t stopped = tracer.occluded16(rays, 8);
  bits = static_cast<std::uint8_t>(~stopped & 0xffU);
  return bits;
}

std::vector<bool> cells_with_surface(const Mesh& mesh, const Lattice& lattice) {
  std::vector<bool> out(lattice.cell_count());
  const Vec3d half = lattice.spacing * 0.5;
  for (const Triangle& t : mesh.triangles) {
    const Vec3d a = to_double(mesh.position[t[0]]), b = to_double(mesh.position[t[1]]),
                c = to_double(mesh.position[t[2]]);
    const Vec3d low{std::min({a.x, b.x, c.x}), std::min({a.y, b.y, c.y}), std::min({a.z, b.z, c.z})};
    const Vec3d high{std::max({a.x, b.x, c.x}), std::max({a.y, b.y, c.y}), std::max({a.z, b.z, c.z})};
    const auto first = place_in(lattice, low).cell, last = place_in(lattice, high).cell;
    const Vec3d normal = cross(b - a, c - a);
    for (int z = first[2]; z <= last[2]; ++z) {
      for (int y = first[1]; y <= last[1]; ++y) {
        for (int x = first[0]; x <= last[0]; ++x) {
          // A border cell also stands for the half spacing beyond the outermost vertices: twice the box covers it.
          const Vec3d middle = lattice.position({x, y, z}) + half;
          if (plane_meets(normal, a, middle, lattice.spacing)) out[lattice.cell_index({x, y, z})] = true;
        }
      }
    }
  }
  return out;
}

std::vector<CellCorners> find_cell_corners(const Tracer& tracer, const Lattice& lattice,
                                           const std::vector<Vec3f>& stands, std::uint64_t& rays, Threads& threads) {
  CellCorners open;
  open.room.fill(0xff);
  std::vector<CellCorners> cells(lattice.cell_count(), open);
  const std::vector<bool> crossed = cells_with_surface(tracer.scene().mesh, lattice);
  std::atomic<std::uint64_t> asked = 0;
  threads.for_blocks(cells.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (!crossed[i]) continue;
      CellPlace place{lattice.cell(i), {}};
      for (std::size_t eighth = 0; eighth < 8; ++eighth) {
        const auto part = [&](std::size_t axis) { return (eighth >> axis & 1U) != 0 ? 0.75 : 0.25; };
        const Vec3d& s = lattice.spacing;
        const Vec3d middle = lattice.position(place.cell) + Vec3d{s.x * part(0), s.y * part(1), s.z * part(2)};
        cells[i].room[eighth] = corners_seen(tracer, lattice, stands, place, to_float(middle));
      }
      asked += 64;
    }
  });
  const std::vector<Vote> votes = surface_votes(tracer, lattice, stands, threads);
  std::vector<Votes> groups;
  for (std::size_t first = 0, last = 0; first < votes.size(); first = last) {
    while (last < votes.size() && votes[last].key == votes[first].key) ++last;
    groups.push_back(Votes(votes).subspan(first, last - first));
  }
  threads.for_blocks(groups.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint64_t key = groups[i].front().key;
      cells[key / kDirections].surface[key % kDirections] = best_cut(groups[i]);
    }
  });
  rays += asked + 9 * votes.size();
  return cells;
}

}  // namespace kiln
