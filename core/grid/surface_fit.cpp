#include "core/grid/surface_fit.h"

#include <array>
#include <cmath>

#include "core/base/expects.h"

namespace kiln {
namespace {

constexpr std::size_t kBlock = 1024;
constexpr int kSteps = 24;
constexpr std::size_t kFunctions = 9;

using Functions = std::array<float, kFunctions>;
using Coefficients = std::array<Vec3f, kFunctions>;
using Unknowns = std::vector<Coefficients>;  // of each vertex
using PlaceReadings = std::vector<Vec3f>;    // of each place

const auto kLinear = static_cast<float>(kBand1 * std::sqrt(3.0));
const auto kMixed = static_cast<float>(kBand2 * std::sqrt(15.0));
const auto kZonal = static_cast<float>(kBand2 * std::sqrt(5.0) / 2);

Functions functions_of(const Vec3f& n) {
  return {1,
          kLinear * n.x,
          kLinear * n.y,
          kLinear * n.z,
          kMixed * n.x * n.y,
          kMixed * n.x * n.z,
          kMixed * n.y * n.z,
          kZonal * (3 * n.z * n.z - 1),
          kMixed / 2 * (n.x * n.x - n.y * n.y)};
}

/// The same as parts of equation 2 of irradiance_vectors.h; 1 = n.x^2 + n.y^2 + n.z^2.
void add_to_parts(const Coefficients& y, std::size_t vertex, Grid& grid) {
  const Vec3f even = y[0] * 2.0F;
  const std::array<Vec3f, kExactParts> more{y[1] * (2 * kLinear),
                                            y[2] * (2 * kLinear),
                                            y[3] * (2 * kLinear),
                                            even - y[7] * (2 * kZonal) + y[8] * kMixed,
                                            even - y[7] * (2 * kZonal) - y[8] * kMixed,
                                            even + y[7] * (4 * kZonal),
                                            y[4] * (4 * kMixed),
                                            y[5] * (4 * kMixed),
                                            y[6] * (4 * kMixed)};
  for (std::size_t k = 0; k < kExactParts; ++k) grid.parts[k][vertex] += more[k];
}

/// The matrix of equation 1, by places and by vertices.
class Equations {
 public:
  Equations(const std::vector<SurfacePlace>& places, const Grid& grid, Threads& threads)
      : threads_(threads), rows_(places.size()), first_(grid.lattice.vertices() + 1) {
    threads.for_blocks(rows_.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const SurfacePlace& p = places[i];
        const CornersRead at = corners_read(grid, to_double(p.position), p.normal, GridPlace::surface);
        rows_[i] = {linear_read(grid.lattice, at), functions_of(p.normal)};
      }
    });
    each_entry([&](std::uint32_t vertex, const Entry&) { ++first_[vertex + 1]; });
    for (std::size_t v = 1; v < first_.size(); ++v) first_[v] += first_[v - 1];
    entries_.resize(first_.back());
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    each_entry([&](std::uint32_t vertex, const Entry& entry) { entries_[next[vertex]++] = entry; });
  }

  std::size_t vertices() const { return first_.size() - 1; }

  /// out = A y
  void read(const Unknowns& y, PlaceReadings& out) const {
    threads_.for_blocks(rows_.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Row& row = rows_[i];
        out[i] = {};
        for (std::size_t k = 0; k < 8; ++k) {
          if (row.read.weight[k] == 0) continue;
          const Coefficients& at = y[row.read.vertex[k]];
          for (std::size_t j = 0; j < kFunctions; ++j) out[i] += at[j] * (row.read.weight[k] * row.functions[j]);
        }
      }
    });
  }
  /// out = A^T r - kTrust y
  void gradient(const PlaceReadings& r, const Unknowns& y, Unknowns& out) const {
    threads_.for_blocks(vertices(), kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t v = begin; v < end; ++v) {
        for (std::size_t j = 0; j < kFunctions; ++j) out[v][j] = y[v][j] * -kTrust;
        for (std::size_t e = first_[v]; e < first_[v + 1]; ++e) {
          const Functions& f = rows_[entries_[e].place].functions;
          const Vec3f by = r[entries_[e].place] * entries_[e].weight;
          for (std::size_t j = 0; j < kFunctions; ++j) out[v][j] += by * f[j];
        }
      }
    });
  }

 private:
  struct Row {
    LinearRead read;
    Functions functions{};
  };
  struct Entry {
    std::uint32_t place = 0;
    float weight = 0;
  };
  template <class F>
  void each_entry(const F& f) const {
    for (std::uint32_t i = 0; i < rows_.size(); ++i) {
      const LinearRead& read = rows_[i].read;
      for (std::size_t k = 0; k < 8; ++k) {
        if (read.weight[k] != 0) f(read.vertex[k], Entry{i, read.weight[k]});
      }
    }
  }

  Threads& threads_;
  std::vector<Row> rows_;
  std::vector<std::size_t> first_;  // entries of vertex v: first_[v] .. first_[v + 1] - 1
  std::vector<Entry> entries_;
};

void add_squares(const Vec3f& x, Vec3d& sum) {
  const Vec3d d = to_double(x);
  sum += Vec3d{d.x * d.x, d.y * d.y, d.z * d.z};
}
void add_squares(const Coefficients& y, Vec3d& sum) {
  for (const Vec3f& x : y) add_squares(x, sum);
}

/// |x|^2 of each channel.
template <class T>
Vec3d squares(const std::vector<T>& x, Threads& threads) {
  std::vector<Vec3d> sums((x.size() + kBlock - 1) / kBlock);
  threads.for_blocks(x.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) add_squares(x[i], sums[begin / kBlock]);
  });
  Vec3d sum;
  for (const Vec3d& s : sums) sum += s;
  return sum;
}

Vec3f ratio(const Vec3d& a, const Vec3d& b) {
  Vec3f out;
  for (std::size_t c = 0; c < 3; ++c) out[c] = b[c] > 0 ? static_cast<float>(a[c] / b[c]) : 0.0F;
  return out;
}

template <class F>
void each(std::size_t count, Threads& threads, const F& f) {
  threads.for_blocks(count, kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) f(i);
  });
}

/// y of equation 1. `left` is r, and becomes what is left of it.
Unknowns solve(const Equations& equations, PlaceReadings left, Threads& threads) {
  const std::size_t n = equations.vertices();
  Unknowns y(n), slope(n), way;
  PlaceReadings along(left.size());
  equations.gradient(left, y, slope);
  way = slope;
  Vec3d steep = squares(slope, threads);
  for (int k = 0; k < kSteps; ++k) {
    equations.read(way, along);
    const Vec3f step = ratio(steep, squares(along, threads) + squares(way, threads) * double{kTrust});
    each(n, threads, [&](std::size_t v) {
      for (std::size_t j = 0; j < kFunctions; ++j) y[v][j] += way[v][j] * step;
    });
    each(left.size(), threads, [&](std::size_t i) { left[i] = left[i] - along[i] * step; });
    equations.gradient(left, y, slope);
    const Vec3d next = squares(slope, threads);
    const Vec3f keep = ratio(next, steep);
    steep = next;
    each(n, threads, [&](std::size_t v) {
      for (std::size_t j = 0; j < kFunctions; ++j) way[v][j] = slope[v][j] + way[v][j] * keep;
    });
  }
  return y;
}

}  // namespace

void fit_to_surface(const std::vector<SurfacePlace>& places, Grid& grid, Threads& threads) {
  EXPECTS(grid.blend == GridBlend::exact);
  PlaceReadings missing(places.size());
  each(places.size(), threads, [&](std::size_t i) {
    missing[i] = places[i].light - irradiance_at(grid, to_double(places[i].position), places[i].normal);
  });
  const Unknowns y = solve(Equations(places, grid, threads), std::move(missing), threads);
  each(y.size(), threads, [&](std::size_t v) { add_to_parts(y[v], v, grid); });
}

}  // namespace kiln
