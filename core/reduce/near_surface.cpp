#include "core/reduce/near_surface.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/base/index_table.h"
#include "core/base/random.h"
#include "core/mesh/triangle_distance.h"

namespace kiln {
struct NearSurface::Cells {
  const Mesh& mesh;
  ClosestPoint tree;
  std::vector<FlatTriangle> faces;
  double size = 1, margin = 0.5;
  std::vector<std::uint64_t> keys;
  std::vector<std::uint32_t> first;  // of each key's list; one more at the end
  std::vector<std::uint32_t> list;
  IndexTable table;

  explicit Cells(const Mesh& m) : mesh(m), tree(m) {
    double area = 0;
    for (const Triangle& t : mesh.triangles) {
      const auto corner = [&](std::size_t c) { return to_double(mesh.position[t[c]]); };
      faces.emplace_back(corner(0), corner(1), corner(2));
      area += faces.back().area();
    }
    size = std::max(1e-5, std::sqrt(2 * area / static_cast<double>(std::max<std::size_t>(1, faces.size()))));
    margin = 0.5 * size;
    build();
  }

  std::int64_t cell(double x) const { return floor_of(x / size); }
  static std::uint64_t key(std::int64_t x, std::int64_t y, std::int64_t z) {
    constexpr std::int64_t kOffset = 1 << 20, kMask = (1 << 21) - 1;
    const auto part = [](std::int64_t i) { return static_cast<std::uint64_t>((i + kOffset) & kMask); };
    return part(x) << 42 | part(y) << 21 | part(z);
  }

  void build() {
    struct Entry {
      std::uint64_t key;
      std::uint32_t face;
    };
    std::vector<Entry> entries;
    for (std::uint32_t i = 0; i < faces.size(); ++i)
      for_cells(faces[i], [&](std::uint64_t k) { entries.push_back({k, i}); });
    std::sort(entries.begin(), entries.end(),
              [](const Entry& a, const Entry& b) { return a.key != b.key ? a.key < b.key : a.face < b.face; });
    for (const Entry& e : entries) {
      if (keys.empty() || keys.back() != e.key) {
        keys.push_back(e.key);
        first.push_back(static_cast<std::uint32_t>(list.size()));
        table.add(static_cast<std::uint32_t>(keys.size() - 1), [&](std::uint32_t k) { return mix64(keys[k]); });
      }
      list.push_back(e.face);
    }
    first.push_back(static_cast<std::uint32_t>(list.size()));
  }

  /// The cells that have a point within the margin of the face, and a few more.
  template <class Visit>
  void for_cells(const FlatTriangle& f, const Visit& visit) const {
    const Vec3d b = f.a + f.e1, c = f.a + f.e2;
    std::int64_t low[3], high[3];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = cell(std::min({f.a[axis], b[axis], c[axis]}) - margin);
      high[axis] = cell(std::max({f.a[axis], b[axis], c[axis]}) + margin);
    }
    for (std::int64_t x = low[0]; x <= high[0]; ++x) {
      for (std::int64_t y = low[1]; y <= high[1]; ++y) {
        for (std::int64_t z = low[2]; z <= high[2]; ++z) {
          const Vec3d center{(double(x) + 0.5) * size, (double(y) + 0.5) * size, (double(z) + 0.5) * size};
          const auto& n = f.normal;
          const double reach = margin + 0.5 * size * (std::abs(n.x) + std::abs(n.y) + std::abs(n.z));
          if (std::abs(dot(n, center) - f.distance) <= reach) visit(key(x, y, z));
        }
      }
    }
  }
};

NearSurface::NearSurface(const Mesh& mesh) : cells_(std::make_unique<Cells>(mesh)) {}
NearSurface::~NearSurface() = default;

std::optional<NearMatch> NearSurface::query(const Vec3d& point, const Vec3d& normal) const {
  const Cells& c = *cells_;
  const std::uint64_t key = Cells::key(c.cell(point.x), c.cell(point.y), c.cell(point.z));
  const std::uint32_t at = c.table.find(mix64(key), [&](std::uint32_t i) { return c.keys[i] == key; });
  NearPlace best, any;  // the nearest that looks the same way, and the nearest of all
  double best_distance = c.margin, any_distance = c.margin;
  std::uint32_t face = IndexTable::kNone, any_face = IndexTable::kNone;
  if (at != IndexTable::kNone) {
    for (std::uint32_t i = c.first[at]; i < c.first[at + 1]; ++i) {
      const FlatTriangle& f = c.faces[c.list[i]];
      const bool compatible = dot(f.normal, normal) > ClosestPoint::kCompatibleCosine;
      const double limit = compatible ? best_distance : any_distance;
      if (std::abs(dot(f.normal, point) - f.distance) >= limit || f.is_beyond(point, limit)) continue;
      const NearPlace place = nearest_place(f, point);
      if (place.squared >= limit * limit) continue;
      const double distance = std::sqrt(place.squared);
      if (distance < any_distance) any = place, any_face = c.list[i], any_distance = distance;
      if (compatible) best = place, face = c.list[i], best_distance = distance;
    }
  }
  if (face != IndexTable::kNone) return NearMatch{{face, best.u, best.v, best_distance}, any_distance};
  if (any_face != IndexTable::kNone) return NearMatch{{any_face, any.u, any.v, any_distance}, any_distance};
  const auto match = c.tree.query(point, Vec3d{});
  return match ? std::optional(NearMatch{*match, match->distance}) : std::nullopt;
}

}  // namespace kiln
