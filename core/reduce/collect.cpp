#include "core/reduce/collect.h"

#include <algorithm>
#include <bit>

#include "core/base/index_table.h"
#include "core/base/random.h"

namespace kiln {
namespace {

class Collector {
 public:
  explicit Collector(const UnitFrame& frame) : frame_(frame) {}

  void take(const TriangleBatch& batch) {
    for (std::size_t t = 0; t < batch.triangles(); ++t) {
      Triangle corners;
      for (std::size_t c = 0; c < 3; ++c) corners[c] = vertex(frame_.to_unit(batch.position[3 * t + c]));
      add(corners, batch.color.empty() ? nullptr : &batch.color[3 * t]);
    }
  }

  Surface finish() {
    add_borders();
    drop_unused(surface_);
    return std::move(surface_);
  }

 private:
  static std::uint64_t hash(const Vec3d& p) {
    return mix64(mix64(mix64(std::bit_cast<std::uint64_t>(p.x)) ^ std::bit_cast<std::uint64_t>(p.y)) ^
                 std::bit_cast<std::uint64_t>(p.z));
  }
  static std::uint64_t hash(const Triangle& t) { return mix64(mix64(std::uint64_t{t[0]} << 32 | t[1]) ^ t[2]); }

  std::uint32_t vertex(const Vec3d& place) {
    const Vec3d p = place + Vec3d{};  // -0 becomes +0
    auto& all = surface_.position;
    std::uint32_t v = places_.find(hash(p), [&](std::uint32_t i) { return all[i] == p; });
    if (v != IndexTable::kNone) return v;
    v = static_cast<std::uint32_t>(all.size());
    all.push_back(p);
    surface_.sample.emplace_back();
    places_.add(v, [&](std::uint32_t i) { return hash(all[i]); });
    return v;
  }

  void add(Triangle t, const Vec3f* color) {
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) return;
    const auto least = std::min_element(t.begin(), t.end()) - t.begin();
    Triangle turned = t;
    std::rotate(turned.begin(), turned.begin() + least, turned.end());
    auto& all = surface_.triangles;
    if (known_.find(hash(turned), [&](std::uint32_t i) { return all[i] == turned; }) != IndexTable::kNone) return;
    all.push_back(turned);
    known_.add(static_cast<std::uint32_t>(all.size() - 1), [&](std::uint32_t i) { return hash(all[i]); });

    const auto& p = surface_.position;
    const Vec3d n = cross(p[t[1]] - p[t[0]], p[t[2]] - p[t[0]]);
    const double twice = length(n);
    if (!(twice > 0)) return;
    for (std::size_t c = 0; c < 3; ++c) {
      Sample& s = surface_.sample[t[c]];
      s.quadric.add_plane(n / twice, dot(n, p[t[0]]) / twice, twice / 6);
      s.weight += twice / 6;
      s.color += (color ? color[c] : Vec3f{1, 1, 1}) * static_cast<float>(twice / 6);
    }
  }

  /// Edges of one triangle only draw both their ends to their line.
  void add_borders() {
    struct Edge {
      std::uint32_t low, high;
      bool operator<(const Edge& o) const { return low != o.low ? low < o.low : high < o.high; }
      bool operator==(const Edge& o) const { return low == o.low && high == o.high; }
    };
    std::vector<Edge> edges;
    edges.reserve(3 * surface_.triangles.size());
    for (const Triangle& t : surface_.triangles) {
      for (std::size_t c = 0; c < 3; ++c) {
        const auto [low, high] = std::minmax(t[c], t[(c + 1) % 3]);
        edges.push_back({low, high});
      }
    }
    std::sort(edges.begin(), edges.end());
    for (std::size_t i = 0; i < edges.size();) {
      std::size_t end = i + 1;
      while (end < edges.size() && edges[end] == edges[i]) ++end;
      if (end == i + 1) {
        const Vec3d a = surface_.position[edges[i].low], b = surface_.position[edges[i].high];
        for (const std::uint32_t v : {edges[i].low, edges[i].high})
          surface_.sample[v].quadric.add_line(b - a, cross(a, b), kBorderWeight);
      }
      i = end;
    }
  }

  const UnitFrame frame_;
  Surface surface_;
  IndexTable places_, known_;
};

}  // namespace

Result<Surface> collect(const TriangleSource& source, const Extent& extent, Threads& threads) {
  Collector collector(extent.frame());
  const Detail detail = source.colors ? Detail::all : Detail::positions;
  const auto take = [&](const TriangleBatch& batch) { collector.take(batch); };
  if (auto done = source.stream(detail, take, threads); !done) return tl::make_unexpected(done.error());
  return collector.finish();
}

}  // namespace kiln
