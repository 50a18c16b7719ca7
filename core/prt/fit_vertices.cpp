#include "core/prt/fit_vertices.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>

#include "core/base/index_table.h"
#include "core/base/random.h"
#include "core/mesh/topology.h"

namespace kiln {
namespace {

constexpr float kVertexShare = 1.0F / 20, kMiddleShare = 17.0F / 60;  // of a triangle's area
constexpr float kSameValue = 1.0F / 16;  // relative difference of rows that a seam alone does not explain
constexpr int kMostSweeps = 32;
constexpr float kConverged = 1e-6F;  // of the squared residual: 1e-3 of the correction, which is itself small

constexpr std::size_t kFour = RowStore::kFour;
using Four = std::array<float, kFour>;

/// Vertices that share their place, normal and nearly their value share an unknown.
class Unknowns {
 public:
  Unknowns(const ClosedMesh& closed, const RowStore& rows) : mesh_(closed.mesh), closed_(closed), rows_(rows) {
    const auto vertices = static_cast<std::uint32_t>(mesh_.position.size());
    of_vertex.resize(vertices);
    IndexTable first;  // vertices that opened an unknown
    for (std::uint32_t v = 0; v < vertices; ++v) {
      const std::uint32_t same = first.find(hash(v), [&](std::uint32_t w) { return alike(v, w); });
      if (same != IndexTable::kNone) {
        of_vertex[v] = of_vertex[same];
        continue;
      }
      of_vertex[v] = count++;
      first.add(v, [&](std::uint32_t w) { return hash(w); });
    }
  }

  std::vector<std::uint32_t> of_vertex;
  std::uint32_t count = 0;

 private:
  std::uint64_t hash(std::uint32_t v) const {
    std::uint64_t h = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      h = mix64(h ^ (std::uint64_t{std::bit_cast<std::uint32_t>(mesh_.position[v][i] + 0.0F)} << 32 |
                     std::bit_cast<std::uint32_t>(mesh_.normal[v][i] + 0.0F)));
    }
    return h;
  }

  bool alike(std::uint32_t v, std::uint32_t w) const {
    if (!(mesh_.position[v] == mesh_.position[w]) || !(mesh_.normal[v] == mesh_.normal[w])) return false;
    float difference = 0, size = 0;
    for (std::size_t four = 0; four < rows_.fours(); ++four) {
      Four a, b;
      rows_.load_four(closed_.point[v], four, a.data());
      rows_.load_four(closed_.point[w], four, b.data());
      for (std::size_t i = 0; i < kFour; ++i) {
        difference += (a[i] - b[i]) * (a[i] - b[i]);
        size += a[i] * a[i] + b[i] * b[i];
      }
    }
    return difference <= kSameValue * kSameValue * size;
  }

  const Mesh& mesh_;
  const ClosedMesh& closed_;
  const RowStore& rows_;
};

/// The normal equations, the same for every column: weights of vertices, and half weights of edges.
class System {
 public:
  System(const ClosedMesh& closed, const RowStore& rows)
      : closed_(closed), rows_(rows), unknowns_(closed, rows), own_(closed.mesh.position.size(), 0.0F) {
    for (const Triangle& t : closed.mesh.triangles) {
      const auto area = static_cast<float>(triangle_area(closed.mesh, t));
      for (const std::uint32_t v : t) own_[v] += kVertexShare * area;
    }
    weight_.assign(unknowns_.count, std::numeric_limits<float>::min());  // a vertex without a face keeps its sample
    for (std::size_t v = 0; v < own_.size(); ++v) weight_[unknowns_.of_vertex[v]] += own_[v];
    diagonal_ = weight_;
    for (const EdgeSample& s : closed.samples) {
      diagonal_[unknown(s.a)] += 0.25F * kMiddleShare * s.area;
      diagonal_[unknown(s.b)] += 0.25F * kMiddleShare * s.area;
    }
  }

  std::uint32_t unknown(std::uint32_t vertex) const { return unknowns_.of_vertex[vertex]; }
  std::uint32_t unknowns() const { return unknowns_.count; }

  /// Four columns by conjugate gradients with the diagonal as preconditioner, from the samples as first guess.
  std::vector<Four> solve(std::size_t four) const;

 private:
  std::vector<Four> first_guess(std::size_t four) const;
  std::vector<Four> residual(std::size_t four, const std::vector<Four>& x) const;
  void apply(const std::vector<Four>& x, std::vector<Four>& out) const;

  const ClosedMesh& closed_;
  const RowStore& rows_;
  Unknowns unknowns_;
  std::vector<float> own_;     // weight of each vertex's sample
  std::vector<float> weight_;  // of each unknown: the sum of its vertices'
  std::vector<float> diagonal_;
};

std::vector<Four> System::first_guess(std::size_t four) const {
  std::vector<Four> x(unknowns_.count);
  std::vector<std::uint32_t> vertices(unknowns_.count, 0);
  for (std::size_t v = 0; v < own_.size(); ++v) {
    Four y;
    rows_.load_four(closed_.point[v], four, y.data());
    Four& sum = x[unknowns_.of_vertex[v]];
    for (std::size_t i = 0; i < kFour; ++i) sum[i] += y[i];
    ++vertices[unknowns_.of_vertex[v]];
  }
  for (std::size_t u = 0; u < x.size(); ++u) {
    for (float& value : x[u]) value /= static_cast<float>(vertices[u]);
  }
  return x;
}

std::vector<Four> System::residual(std::size_t four, const std::vector<Four>& x) const {
  std::vector<Four> r(x.size(), Four{});
  Four y;
  for (std::size_t v = 0; v < own_.size(); ++v) {
    rows_.load_four(closed_.point[v], four, y.data());
    const std::uint32_t u = unknowns_.of_vertex[v];
    for (std::size_t i = 0; i < kFour; ++i) r[u][i] += own_[v] * (y[i] - x[u][i]);
  }
  for (const EdgeSample& s : closed_.samples) {
    const std::uint32_t a = unknown(s.a), b = unknown(s.b);
    rows_.load_four(s.point, four, y.data());
    for (std::size_t i = 0; i < kFour; ++i) {
      const float pull = 0.5F * kMiddleShare * s.area * (y[i] - 0.5F * (x[a][i] + x[b][i]));
      r[a][i] += pull;
      r[b][i] += pull;
    }
  }
  return r;
}

void System::apply(const std::vector<Four>& x, std::vector<Four>& out) const {
  for (std::size_t u = 0; u < x.size(); ++u) {
    for (std::size_t i = 0; i < kFour; ++i) out[u][i] = weight_[u] * x[u][i];
  }
  for (const EdgeSample& s : closed_.samples) {
    const std::uint32_t a = unknown(s.a), b = unknown(s.b);
    for (std::size_t i = 0; i < kFour; ++i) {
      const float middle = 0.25F * kMiddleShare * s.area * (x[a][i] + x[b][i]);
      out[a][i] += middle;
      out[b][i] += middle;
    }
  }
}

std::vector<Four> System::solve(std::size_t four) const {
  std::vector<Four> x = first_guess(four), r = residual(four, x), p(x.size()), q(x.size());
  using Sums = std::array<double, kFour>;
  const auto preconditioned_norm = [&] {
    Sums sums{};
    for (std::size_t u = 0; u < r.size(); ++u) {
      for (std::size_t i = 0; i < kFour; ++i) sums[i] += double{r[u][i]} * r[u][i] / diagonal_[u];
    }
    return sums;
  };
  const Sums first = preconditioned_norm();
  Sums norm = first, ratio{};
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    for (std::size_t u = 0; u < p.size(); ++u) {
      for (std::size_t i = 0; i < kFour; ++i) {
        p[u][i] = r[u][i] / diagonal_[u] + static_cast<float>(ratio[i]) * p[u][i];
      }
    }
    apply(p, q);
    Sums curvature{}, step{};
    for (std::size_t u = 0; u < p.size(); ++u) {
      for (std::size_t i = 0; i < kFour; ++i) curvature[i] += double{p[u][i]} * q[u][i];
    }
    bool done = true;
    for (std::size_t i = 0; i < kFour; ++i) {
      const bool converged = norm[i] <= kConverged * first[i] || curvature[i] <= 0;
      step[i] = converged ? 0 : norm[i] / curvature[i];
      done = done && converged;
    }
    if (done) break;
    for (std::size_t u = 0; u < x.size(); ++u) {
      for (std::size_t i = 0; i < kFour; ++i) {
        x[u][i] += static_cast<float>(step[i]) * p[u][i];
        r[u][i] -= static_cast<float>(step[i]) * q[u][i];
      }
    }
    const Sums next = preconditioned_norm();
    for (std::size_t i = 0; i < kFour; ++i) ratio[i] = norm[i] > 0 ? next[i] / norm[i] : 0;
    norm = next;
  }
  return x;
}

/// How far along the way from its sample (0) to its fit (1) each unknown may go in one column of a four.
class Limits {
 public:
  Limits(const System& system, const ClosedMesh& closed, const RowStore& rows)
      : system_(system), closed_(closed), rows_(rows), way_(system.unknowns(), 1.0F) {}

  void hold(std::size_t column, const std::vector<Four>& fitted) {
    std::vector<Range> range(way_.size());
    for (std::uint32_t v = 0; v < closed_.point.size(); ++v) {
      range[system_.unknown(v)].hold(sample(closed_.point[v], column));
    }
    for (const EdgeSample& s : closed_.samples) {
      const float y = sample(s.point, column);
      range[system_.unknown(s.a)].hold(y);
      range[system_.unknown(s.b)].hold(y);
    }
    for (std::uint32_t v = 0; v < closed_.point.size(); ++v) {
      const std::uint32_t u = system_.unknown(v);
      const float from = sample(closed_.point[v], column), to = fitted[u][column % kFour];
      const float room = to > from ? range[u].high - from : from - range[u].low, step = std::abs(to - from);
      if (step > room) way_[u] = std::min(way_[u], room / step);
    }
  }

  float way(std::uint32_t unknown) const { return way_[unknown]; }

 private:
  struct Range {
    float low = std::numeric_limits<float>::infinity(), high = -low;
    void hold(float x) { low = std::min(low, x), high = std::max(high, x); }
  };
  float sample(std::uint32_t point, std::size_t column) const {
    Four y;
    rows_.load_four(point, column / kFour, y.data());
    return y[column % kFour];
  }

  const System& system_;
  const ClosedMesh& closed_;
  const RowStore& rows_;
  std::vector<float> way_;
};

/// Four columns of all vertices, each as far from its sample as the limits allow.
std::vector<Four> limited(const System& system, const ClosedMesh& closed, const RowStore& rows, std::size_t four,
                          const Limits& limits) {
  const std::vector<Four> x = system.solve(four);
  std::vector<Four> values(closed.point.size());
  for (std::uint32_t v = 0; v < values.size(); ++v) {
    const std::uint32_t u = system.unknown(v);
    rows.load_four(closed.point[v], four, values[v].data());
    for (std::size_t i = 0; i < kFour; ++i) values[v][i] += limits.way(u) * (x[u][i] - values[v][i]);
  }
  return values;
}

}  // namespace

std::vector<float> fit_vertices(const ClosedMesh& closed, RowStore rows, std::span<const std::size_t> bounded,
                                Threads& threads) {
  const std::size_t vertices = closed.point.size(), width = rows.width();
  const System system(closed, rows);
  Limits limits(system, closed, rows);
  for (std::size_t four = 0; four < rows.fours(); ++four) {
    std::vector<Four> fitted;
    for (const std::size_t column : bounded) {
      if (column / kFour != four) continue;
      if (fitted.empty()) fitted = system.solve(four);
      limits.hold(column, fitted);
    }
  }

  std::vector<std::vector<Four>> columns(rows.fours());
  threads.for_blocks(columns.size(), 1, [&](std::size_t four, std::size_t) {
    columns[four] = limited(system, closed, rows, four, limits);
    rows.release(four);
  });
  std::vector<float> values(vertices * width);
  for (std::size_t four = 0; four < columns.size(); ++four) {
    for (std::size_t v = 0; v < vertices; ++v) {
      std::copy_n(columns[four][v].data(), std::min(kFour, width - four * kFour),
                  values.data() + v * width + four * kFour);
    }
    columns[four] = {};
  }
  return values;
}

}  // namespace kiln
