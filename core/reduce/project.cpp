#include "core/reduce/project.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <optional>

#include "core/base/index_table.h"
#include "core/base/random.h"
#include "core/mesh/triangle_distance.h"
#include "core/reduce/near_surface.h"

namespace kiln {
namespace {

constexpr std::size_t kShards = 8, kBlock = 2048;
constexpr std::size_t kMostPoints = 1U << 18;  // of a group: what is held of a batch at once
constexpr std::uint32_t kMostCuts = 512;       // of a triangle's edge
constexpr std::size_t kProbes = 20'000, kWitnesses = 16'000;

/// Points of the reduced mesh that wait for the nearest triangle of the model.
class Witnesses {
 public:
  Witnesses(const Mesh& mesh, double reach, std::uint64_t seed) : reach_(reach) {
    std::vector<double> until;
    double area = 0;
    for (const Triangle& t : mesh.triangles) {
      const auto p = [&](std::size_t c) { return to_double(mesh.position[t[c]]); };
      until.push_back(area += 0.5 * length(cross(p(1) - p(0), p(2) - p(0))));
    }
    for (std::size_t i = 0; i < kWitnesses && area > 0; ++i) {
      Random random(seed, i);
      const double at = (static_cast<double>(i) + random.uniform_double()) / kWitnesses * area;
      const auto found = std::upper_bound(until.begin(), until.end(), at) - until.begin();
      const Triangle& t = mesh.triangles[std::min(static_cast<std::size_t>(found), mesh.triangles.size() - 1)];
      const double r = std::sqrt(random.uniform_double()), v = r * random.uniform_double();
      point_.push_back(to_double(mesh.position[t[0]]) * (1 - r) + to_double(mesh.position[t[1]]) * (r - v) +
                       to_double(mesh.position[t[2]]) * v);
    }
    squared_ = std::vector<std::atomic<double>>(point_.size());
    for (auto& d : squared_) d = reach * reach;
    build();
  }

  /// Safe on any number of threads: the least of all distances does not depend on their order.
  void see(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    const Vec3d low{std::min({a.x, b.x, c.x}), std::min({a.y, b.y, c.y}), std::min({a.z, b.z, c.z})};
    const Vec3d high{std::max({a.x, b.x, c.x}), std::max({a.y, b.y, c.y}), std::max({a.z, b.z, c.z})};
    std::optional<FlatTriangle> face;
    const double cells =
        (high.x - low.x + reach_) * (high.y - low.y + reach_) * (high.z - low.z + reach_) / (reach_ * reach_ * reach_);
    if (cells > static_cast<double>(point_.size())) {  // a triangle across the whole model
      face.emplace(a, b, c);
      for (std::uint32_t i = 0; i < point_.size(); ++i) offer(i, *face);
      return;
    }
    for (std::int64_t x = cell(low.x); x <= cell(high.x); ++x) {
      for (std::int64_t y = cell(low.y); y <= cell(high.y); ++y) {
        for (std::int64_t z = cell(low.z); z <= cell(high.z); ++z) {
          const std::uint64_t k = key(x, y, z);
          if (!(maybe_[k * kSpread >> 58 << 16 | (mix64(k) & 0xffff)])) continue;
          const std::uint32_t at = table_.find(mix64(k), [&](std::uint32_t i) { return keys_[i] == k; });
          if (at == IndexTable::kNone) continue;
          if (!face) face.emplace(a, b, c);
          for (std::uint32_t i = first_[at]; i < first_[at + 1]; ++i) offer(list_[i], *face);
        }
      }
    }
  }

  void tell(GeometricError& error, double diagonal) const {
    double sum = 0, most = 0;
    for (const auto& d : squared_) {
      sum += d, most = std::max(most, d.load());
      error.beyond += d >= reach_ * reach_ ? 1 : 0;
    }
    error.points_back = squared_.size();
    if (squared_.empty()) return;
    error.rms_back = std::sqrt(sum / static_cast<double>(squared_.size())) / diagonal;
    error.most_back = std::sqrt(most) / diagonal;
  }

 private:
  static constexpr std::uint64_t kSpread = 0x9e3779b97f4a7c15ULL;

  std::int64_t cell(double x) const { return floor_of(x / reach_); }
  static std::uint64_t key(std::int64_t x, std::int64_t y, std::int64_t z) {
    const auto part = [](std::int64_t i) { return static_cast<std::uint64_t>(i + (1 << 20)) & ((1U << 21) - 1); };
    return part(x) << 42 | part(y) << 21 | part(z);
  }

  void offer(std::uint32_t witness, const FlatTriangle& face) {
    const double height = dot(face.normal, point_[witness]) - face.distance;
    double known = squared_[witness].load(std::memory_order_relaxed);
    if (height * height >= known || face.is_beyond(point_[witness], std::sqrt(known))) return;
    const double squared = nearest_place(face, point_[witness]).squared;
    while (squared < known && !squared_[witness].compare_exchange_weak(known, squared, std::memory_order_relaxed)) {
    }
  }

  /// A witness stands in the lists of all cells around its own.
  void build() {
    struct Entry {
      std::uint64_t key;
      std::uint32_t witness;
    };
    std::vector<Entry> entries;
    for (std::uint32_t i = 0; i < point_.size(); ++i) {
      for (std::int64_t n = 0; n < 27; ++n) {
        const Vec3d& p = point_[i];
        entries.push_back({key(cell(p.x) + n % 3 - 1, cell(p.y) + n / 3 % 3 - 1, cell(p.z) + n / 9 - 1), i});
      }
    }
    std::sort(entries.begin(), entries.end(),
              [](const Entry& a, const Entry& b) { return a.key != b.key ? a.key < b.key : a.witness < b.witness; });
    maybe_.assign(std::size_t{64} << 16, false);
    for (const Entry& e : entries) {
      if (keys_.empty() || keys_.back() != e.key) {
        keys_.push_back(e.key);
        first_.push_back(static_cast<std::uint32_t>(list_.size()));
        table_.add(static_cast<std::uint32_t>(keys_.size() - 1), [&](std::uint32_t k) { return mix64(keys_[k]); });
        maybe_[e.key * kSpread >> 58 << 16 | (mix64(e.key) & 0xffff)] = true;
      }
      list_.push_back(e.witness);
    }
    first_.push_back(static_cast<std::uint32_t>(list_.size()));
  }

  double reach_;
  std::vector<Vec3d> point_;
  std::vector<std::atomic<double>> squared_;
  std::vector<std::uint64_t> keys_;
  std::vector<std::uint32_t> first_, list_;
  std::vector<bool> maybe_;
  IndexTable table_;
};

/// One point of the model on its way to a texel.
struct Splat {
  std::uint32_t texel = IndexTable::kNone;
  std::uint8_t shard = 0;
  Texel value;
};

struct Sums {
  double squared = 0, area = 0, most = 0;
  std::uint64_t points = 0;
};

class Projector {
 public:
  Projector(const Projecting& what, Threads& threads)
      : what_(what),
        threads_(threads),
        near_(what.mesh),
        witnesses_(what.mesh, mean_edge(what.mesh), what.seed),
        probe_every_(std::max<std::uint64_t>(1, what.triangles / kProbes)) {
    if (what.atlas) {
      const auto side = static_cast<std::size_t>(what.atlas->side);
      out_.texels.resize(side * side);
      spacing_ = 1 / what.atlas->density;
    } else {
      spacing_ = 0.5 * mean_edge(what.mesh);
    }
  }

  void take(const TriangleBatch& batch) {
    const std::size_t n = batch.triangles();
    unit_.resize(3 * n), cuts_.resize(n);
    threads_.for_blocks(n, kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t t = begin; t < end; ++t) prepare(batch, t);
    });
    for (std::size_t begin = 0; begin < n;) {
      std::size_t end = begin, points = 0;
      first_.clear();
      while (end < n && (end == begin || points + squared(cuts_[end]) <= kMostPoints)) {
        first_.push_back(points);
        points += squared(cuts_[end++]);
      }
      first_.push_back(points);
      splat(batch, begin, end);
      begin = end;
    }
    for (std::size_t t = (probe_every_ - batch.first % probe_every_) % probe_every_; t < n; t += probe_every_)
      probe(batch, t);
  }

  Projection finish() {
    GeometricError& error = out_.error;
    error.points = sums_.points;
    error.rms = sums_.area > 0 ? std::sqrt(sums_.squared / sums_.area) / what_.diagonal : 0;
    error.most = sums_.most / what_.diagonal;
    witnesses_.tell(error, what_.diagonal);
    return std::move(out_);
  }

 private:
  static std::size_t squared(std::uint32_t n) { return std::size_t{n} * n; }

  static double mean_edge(const Mesh& mesh) {
    double area = 0;
    for (const Triangle& t : mesh.triangles) {
      const auto p = [&](std::size_t c) { return to_double(mesh.position[t[c]]); };
      area += 0.5 * length(cross(p(1) - p(0), p(2) - p(0)));
    }
    return std::max(1e-5, std::sqrt(2 * area / static_cast<double>(std::max<std::size_t>(1, mesh.triangles.size()))));
  }

  void prepare(const TriangleBatch& batch, std::size_t t) {
    Vec3d* p = &unit_[3 * t];
    for (std::size_t c = 0; c < 3; ++c) p[c] = what_.frame.to_unit(batch.position[3 * t + c]);
    witnesses_.see(p[0], p[1], p[2]);
    const double longest = std::max({length(p[1] - p[0]), length(p[2] - p[1]), length(p[0] - p[2])});
    cuts_[t] = static_cast<std::uint32_t>(std::clamp(std::ceil(0.7 * longest / spacing_), 1.0, double{kMostCuts}));
  }

  /// Triangles [begin, end), whose points are numbered by first_.
  void splat(const TriangleBatch& batch, std::size_t begin, std::size_t end) {
    splats_.resize(first_.back());
    parts_.assign((end - begin) / kBlock + 1, {});
    threads_.for_blocks(end - begin, kBlock, [&](std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i) cut(batch, begin + i, &splats_[first_[i]], parts_[from / kBlock]);
    });
    for (const Sums& part : parts_) {
      sums_.squared += part.squared, sums_.area += part.area, sums_.points += part.points;
      sums_.most = std::max(sums_.most, part.most);
    }
    if (!what_.atlas) return;
    threads_.for_blocks(kShards, 1, [&](std::size_t shard, std::size_t) {
      for (const Splat& s : splats_) {
        if (s.shard != shard || s.texel == IndexTable::kNone) continue;
        Texel& texel = out_.texels[s.texel];
        texel.normal += s.value.normal, texel.color += s.value.color;
        texel.weight += s.value.weight;
      }
    });
  }

  Vec3f normal_at(const TriangleBatch& batch, std::size_t t, double u, double v, const Vec3d& flat) const {
    if (batch.normal.empty()) return to_float(flat);
    const Vec3f* n = &batch.normal[3 * t];
    const Vec3f sum =
        n[0] * static_cast<float>(1 - u - v) + n[1] * static_cast<float>(u) + n[2] * static_cast<float>(v);
    return dot(to_double(sum), flat) > 0 ? normalized(sum) : to_float(flat);
  }

  /// The centres of n * n equal parts: those that stand like the whole, and those upside down between them.
  void cut(const TriangleBatch& batch, std::size_t t, Splat* out, Sums& sums) const {
    const Vec3d* p = &unit_[3 * t];
    const Vec3d twice = cross(p[1] - p[0], p[2] - p[0]), flat = normalized(twice, Vec3d{});
    const std::uint32_t n = cuts_[t];
    const double area = 0.5 * length(twice) / static_cast<double>(squared(n));
    for (std::uint32_t i = 0; i < n; ++i) {
      for (std::uint32_t j = 0; i + j < n; ++j) {
        for (const double third : {1.0, 2.0}) {
          if (third == 2 && i + j + 1 >= n) continue;
          const double u = (i + third / 3) / n, v = (j + third / 3) / n;
          *out = {};
          if (area > 0) land(batch, t, u, v, flat, area, *out, sums);
          ++out;
        }
      }
    }
  }

  void land(const TriangleBatch& batch, std::size_t t, double u, double v, const Vec3d& flat, double area, Splat& out,
            Sums& sums) const {
    const Vec3d* p = &unit_[3 * t];
    const Vec3d point = p[0] * (1 - u - v) + p[1] * u + p[2] * v;
    const auto match = near_.query(point, flat);
    if (!match) return;
    sums.squared += match->distance * match->distance * area;
    sums.area += area;
    sums.most = std::max(sums.most, match->distance);
    ++sums.points;
    if (!what_.atlas) return;
    const auto weight = static_cast<float>(area);
    out.texel = texel_at(match->place);
    out.shard = static_cast<std::uint8_t>(out.texel / 64 % kShards);
    out.value.weight = weight;
    out.value.normal = normal_at(batch, t, u, v, flat) * weight;
    if (!batch.color.empty()) out.value.color = color_at(batch, t, u, v) * weight;
  }

  static Vec3f color_at(const TriangleBatch& batch, std::size_t t, double u, double v) {
    if (batch.texture) return batch.texture(t, u, v);
    const Vec3f* c = &batch.color[3 * t];
    return c[0] * static_cast<float>(1 - u - v) + c[1] * static_cast<float>(u) + c[2] * static_cast<float>(v);
  }

  std::uint32_t texel_at(const SurfaceMatch& match) const {
    const Atlas& atlas = *what_.atlas;
    const Chart& chart = atlas.charts[atlas.chart_of[match.triangle]];
    const auto at = chart.texel(match_position(what_.mesh, match), atlas.density, atlas.padding);
    const int x = std::clamp(static_cast<int>(std::floor(at.x)), chart.x, chart.x + chart.width - 1);
    const int y = std::clamp(static_cast<int>(std::floor(at.y)), chart.y, chart.y + chart.height - 1);
    return static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(atlas.side) + static_cast<std::uint32_t>(x);
  }

  void probe(const TriangleBatch& batch, std::size_t t) {
    const Vec3d* p = &unit_[3 * t];
    const Vec3d twice = cross(p[1] - p[0], p[2] - p[0]), flat = normalized(twice, Vec3d{});
    if (!(length(flat) > 0)) return;
    const auto match = near_.query((p[0] + p[1] + p[2]) / 3.0, flat);
    if (!match) return;
    out_.probes.push_back({match->place.triangle, static_cast<float>(match->place.u),
                           static_cast<float>(match->place.v), normal_at(batch, t, 1.0 / 3, 1.0 / 3, flat),
                           0.5 * length(twice)});
  }

  const Projecting& what_;
  Threads& threads_;
  const NearSurface near_;
  Witnesses witnesses_;
  const std::uint64_t probe_every_;
  double spacing_ = 1;
  Projection out_;
  Sums sums_;
  std::vector<Vec3d> unit_;
  std::vector<std::uint32_t> cuts_;
  std::vector<std::size_t> first_;
  std::vector<Splat> splats_;
  std::vector<Sums> parts_;
};

}  // namespace

Result<Projection> project(const TriangleSource& source, const Projecting& what, Threads& threads) {
  Projector projector(what, threads);
  const Detail detail = what.atlas || source.normals ? Detail::all : Detail::positions;
  const auto take = [&](const TriangleBatch& batch) { projector.take(batch); };
  if (auto done = source.stream(detail, take, threads); !done) return tl::make_unexpected(done.error());
  return projector.finish();
}

}  // namespace kiln
