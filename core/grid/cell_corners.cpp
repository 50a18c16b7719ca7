#include "core/grid/cell_corners.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <span>

#include "core/base/random.h"
#include "core/grid/corner_votes.h"
#include "core/grid/corners_beyond.h"
#include "core/mesh/topology.h"
#include "core/meshless/points.h"
#include "core/sphere/sampling.h"
#include "core/trace/surface.h"

namespace kiln {
namespace {

constexpr double kPerCell = 16, kPerBusy = 128;  // points to the area of a cell's smallest face
constexpr std::uint64_t kMostPoints = 1U << 16;  // on one triangle
constexpr std::size_t kBlock = 256;

using Votes = std::span<const CornerVote>;

std::uint64_t points_on(double faces, double per_face) {
  return static_cast<std::uint64_t>(std::clamp(std::ceil(per_face * faces), 1.0, double{kMostPoints}));
}

class Voters {
 public:
  Voters(const Tracer& tracer, const Lattice& lattice, const std::vector<Vec3f>& stands)
      : tracer_(tracer), lattice_(lattice), stands_(stands), face_(smallest_face(lattice)) {}

  void add_votes_of(std::uint32_t triangle, std::vector<CornerVote>& votes) const {
    const std::uint64_t count = points_on(faces_of(triangle), kPerCell);
    for (std::uint64_t i = 0; i < count; ++i) add_at(point_of(triangle, i), votes);
  }
  /// Those that kPerBusy has more, where they lie in busy cells.
  void add_more_of(std::uint32_t triangle, const std::vector<bool>& busy, std::vector<CornerVote>& votes) const {
    const double faces = faces_of(triangle);
    for (std::uint64_t i = points_on(faces, kPerCell); i < points_on(faces, kPerBusy); ++i) {
      const SurfacePoint p = point_of(triangle, i);
      if (busy[lattice_.cell_index(place_in(lattice_, to_double(p.position)).cell)]) add_at(p, votes);
    }
  }

 private:
  double faces_of(std::uint32_t triangle) const {
    const Mesh& mesh = tracer_.scene().mesh;
    return triangle_area(mesh, mesh.triangles[triangle]) / face_;
  }
  SurfacePoint point_of(std::uint32_t triangle, std::uint64_t i) const {
    const Vec2f u = sobol_owen(static_cast<std::uint32_t>(i), mix64(triangle));
    const Vec2<double> at = uniform_triangle({u.x, u.y});
    return surface_point(tracer_.scene(), triangle, static_cast<float>(at.x), static_cast<float>(at.y));
  }
  void add_at(const SurfacePoint& p, std::vector<CornerVote>& votes) const {
    const Scene& scene = tracer_.scene();
    const Part& part = scene.parts[scene.mesh.part[p.triangle]];
    votes.push_back(vote(p.position, p.normal, p.geometric_normal));
    if (scene.materials[static_cast<std::size_t>(part.material)].double_sided)
      votes.push_back(vote(p.position, -p.normal, -p.geometric_normal));
  }
  CornerVote vote(const Vec3f& position, const Vec3f& normal, const Vec3f& face) const {
    const CellPlace place = place_in(lattice_, to_double(position));
    const Vec3f origin = offset_origin(position, face);
    const std::uint8_t seen = corners_seen(tracer_, lattice_, stands_, place, origin);
    return {.key = lattice_.cell_index(place.cell) * kDirections + nearest_direction(normal),
            .seen = seen,
            .fraction = place.fraction,
            .origin = origin};
  }

  const Tracer& tracer_;
  const Lattice& lattice_;
  const std::vector<Vec3f>& stands_;
  double face_;
};

/// What `add` brings of each triangle, in their order.
template <class F>
void add_votes(std::size_t triangles, Threads& threads, std::vector<CornerVote>& votes, const F& add) {
  std::vector<std::vector<CornerVote>> found((triangles + kBlock - 1) / kBlock);
  threads.for_blocks(triangles, kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) add(static_cast<std::uint32_t>(t), found[begin / kBlock]);
  });
  for (const auto& own : found) votes.insert(votes.end(), own.begin(), own.end());
}

/// Cells in which places differ, or lie along two axes: there an edge may part them.
std::vector<bool> busy_cells(const Lattice& lattice, Votes votes) {
  struct Seen {
    std::array<std::int16_t, kDirections> bits;
  };
  constexpr std::int16_t kNone = -1, kDiffer = -2;
  Seen none{};
  none.bits.fill(kNone);
  std::vector<Seen> cells(lattice.cell_count(), none);
  for (const CornerVote& v : votes) {
    std::int16_t& bits = cells[v.key / kDirections].bits[v.key % kDirections];
    bits = bits == kNone || bits == v.seen ? v.seen : kDiffer;
  }
  std::vector<bool> busy;
  for (const Seen& cell : cells) {
    int axes = 0;
    for (std::size_t a = 0; a < 3; ++a) axes += cell.bits[2 * a] != kNone || cell.bits[2 * a + 1] != kNone ? 1 : 0;
    busy.push_back(axes > 1 || std::find(cell.bits.begin(), cell.bits.end(), kDiffer) != cell.bits.end());
  }
  return busy;
}

std::vector<CornerVote> surface_votes(const Tracer& tracer, const Lattice& lattice, const std::vector<Vec3f>& stands,
                                      Threads& threads) {
  const Voters voters(tracer, lattice, stands);
  const std::size_t triangles = tracer.scene().mesh.triangles.size();
  std::vector<CornerVote> votes;
  add_votes(triangles, threads, votes, [&](std::uint32_t t, auto& out) { voters.add_votes_of(t, out); });
  const std::vector<bool> busy = busy_cells(lattice, votes);
  add_votes(triangles, threads, votes, [&](std::uint32_t t, auto& out) { voters.add_more_of(t, busy, out); });
  std::stable_sort(votes.begin(), votes.end(), [](const CornerVote& a, const CornerVote& b) { return a.key < b.key; });
  return votes;
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
  const std::vector<CornerVote> votes = surface_votes(tracer, lattice, stands, threads);
  std::vector<Votes> groups;
  for (std::size_t first = 0, last = 0; first < votes.size(); first = last) {
    while (last < votes.size() && votes[last].key == votes[first].key) ++last;
    groups.push_back(Votes(votes).subspan(first, last - first));
  }
  threads.for_blocks(groups.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    std::uint64_t own = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint64_t key = groups[i].front().key;
      CornerCut& cut = cells[key / kDirections].surface[key % kDirections] = best_cut(groups[i]);
      look_beyond(tracer, lattice, stands, groups[i], cut, own);
    }
    asked += own;
  });
  fill_grazed(lattice, crossed, cells, threads);
  rays += asked + 8 * votes.size();
  return cells;
}

}  // namespace kiln
