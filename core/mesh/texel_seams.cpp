#include "core/mesh/texel_seams.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "core/base/expects.h"
#include "core/mesh/topology.h"

namespace kiln {
namespace {

constexpr float kSameNormal = 0.999F;  // cosine: 2.6 degrees
constexpr int kSteps = 60;             // of conjugate gradients; they end sooner where nothing moves
constexpr double kSettled = 1e-6;      // of the first residual
constexpr int kMostPlaces = 65536;     // of one edge: pictures are smaller

/// One side of an edge: its ends by position, ascending, and the vertices that stand there.
struct Side {
  std::array<std::uint32_t, 2> place{}, vertex{};
};

std::vector<Side> sides_of(const Mesh& mesh, const UvCharts& charts) {
  const std::vector<std::uint32_t> place = weld_by_position(mesh.position);
  std::vector<Side> out;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (charts.of[t] == kNoChart) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t a = mesh.triangles[t][k], b = mesh.triangles[t][(k + 1) % 3];
      if (place[a] == place[b]) continue;
      if (place[a] > place[b]) std::swap(a, b);
      out.push_back({{place[a], place[b]}, {a, b}});
    }
  }
  std::ranges::stable_sort(out, {}, &Side::place);
  return out;
}

bool is_seam(const Mesh& mesh, const Side& a, const Side& b) {
  bool apart = false;
  for (std::size_t k = 0; k < 2; ++k) {
    if (dot(mesh.normal[a.vertex[k]], mesh.normal[b.vertex[k]]) < kSameNormal) return false;
    apart = apart || !(mesh.uv1[a.vertex[k]] == mesh.uv1[b.vertex[k]]);
  }
  return apart;
}

/// Equation 1 as a sparse system over the texels that take part.
class Stitching {
 public:
  Stitching(std::span<const SeamPlace> seams, const TexelMap& map) {
    for (const SeamPlace& s : seams) {
      Row row;
      const Bilinear here = bilinear_at(s.here, map.side), there = bilinear_at(s.there, map.side);
      for (std::size_t k = 0; k < 4; ++k) {
        row.texel[k] = number_of(here.texel[k]), row.weight[k] = double{here.weight[k]};
        row.texel[4 + k] = number_of(there.texel[k]), row.weight[4 + k] = -double{there.weight[k]};
      }
      rows_.push_back(row);
    }
    hold_.assign(texels_.size(), kHoldBorder);
    for (const TexelPlace& p : map.places) {
      const auto found = number_.find(p.texel);
      if (found != number_.end() && p.inside) hold_[found->second] = kHoldInside;
    }
    diagonal_ = hold_;
    for (const Row& row : rows_) {
      for (std::size_t k = 0; k < 8; ++k) diagonal_[row.texel[k]] += row.weight[k] * row.weight[k];
    }
  }

  void solve(std::span<Vec3f> values) const {
    for (std::size_t c = 0; c < 3; ++c) {
      std::vector<double> x(texels_.size());
      for (std::size_t i = 0; i < x.size(); ++i) x[i] = double{values[texels_[i]][c]};
      descend(x);
      for (std::size_t i = 0; i < x.size(); ++i) values[texels_[i]][c] = static_cast<float>(std::max(0.0, x[i]));
    }
  }

 private:
  struct Row {
    std::array<std::uint32_t, 8> texel{};
    std::array<double, 8> weight{};
  };
  using Numbers = std::vector<double>;

  std::uint32_t number_of(std::uint32_t texel) {
    const auto [at, added] = number_.try_emplace(texel, static_cast<std::uint32_t>(texels_.size()));
    if (added) texels_.push_back(texel);
    return at->second;
  }

  Numbers apply(const Numbers& x, bool held) const {
    Numbers out(x.size(), 0.0);
    for (std::size_t i = 0; held && i < x.size(); ++i) out[i] = hold_[i] * x[i];
    for (const Row& row : rows_) {
      double apart = 0;
      for (std::size_t k = 0; k < 8; ++k) apart += row.weight[k] * x[row.texel[k]];
      for (std::size_t k = 0; k < 8; ++k) out[row.texel[k]] += row.weight[k] * apart;
    }
    return out;
  }

  static double product(const Numbers& a, const Numbers& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
    return sum;
  }

  /// Conjugate gradients from x = x0, where what is held has no pull.
  void descend(Numbers& x) const {
    Numbers r = apply(x, false), z(x.size());
    for (double& d : r) d = -d;
    const auto scaled = [&] {
      for (std::size_t i = 0; i < z.size(); ++i) z[i] = r[i] / diagonal_[i];
      return product(r, z);
    };
    double size = scaled();
    const double first = size;
    Numbers p = z;
    for (int step = 0; step < kSteps && size > kSettled * kSettled * first; ++step) {
      const Numbers moved = apply(p, true);
      const double length = size / product(p, moved);
      for (std::size_t i = 0; i < x.size(); ++i) x[i] += length * p[i], r[i] -= length * moved[i];
      const double before = size;
      size = scaled();
      for (std::size_t i = 0; i < p.size(); ++i) p[i] = z[i] + size / before * p[i];
    }
  }

  std::unordered_map<std::uint32_t, std::uint32_t> number_;
  std::vector<std::uint32_t> texels_;
  std::vector<Row> rows_;
  Numbers hold_, diagonal_;
};

/// Grows light into the texels that `open` allows, one ring at a time; `joined(from, to)`: light may go there.
template <class Joined>
void grow(int side, std::vector<char>& known, std::span<Vec3f> texels, const Joined& joined) {
  const auto width = static_cast<std::size_t>(side);
  const auto neighbours = [&](std::size_t i, const auto& visit) {
    const std::size_t x = i % width, y = i / width;
    for (std::size_t j = y > 0 ? y - 1 : 0; j <= std::min(y + 1, width - 1); ++j) {
      for (std::size_t k = x > 0 ? x - 1 : 0; k <= std::min(x + 1, width - 1); ++k) visit(j * width + k);
    }
  };
  std::vector<std::uint32_t> ring, next;
  std::vector<char> asked(known.size(), 0);
  const auto ask_around = [&](std::size_t i, std::vector<std::uint32_t>& out) {
    neighbours(i, [&](std::size_t n) {
      if (known[n] != 0 || asked[n] != 0 || !joined(i, n)) return;
      asked[n] = 1;
      out.push_back(static_cast<std::uint32_t>(n));
    });
  };
  for (std::size_t i = 0; i < known.size(); ++i) {
    if (known[i] != 0) ask_around(i, ring);
  }
  for (; !ring.empty(); std::swap(ring, next)) {
    for (const std::uint32_t i : ring) {
      Vec3f sum;
      float count = 0;
      neighbours(i, [&](std::size_t n) {
        if (known[n] == 0 || !joined(n, i)) return;
        sum += texels[n];
        count += 1;
      });
      texels[i] = sum / count;
    }
    for (const std::uint32_t i : ring) known[i] = 1;
    next.clear();
    for (const std::uint32_t i : ring) ask_around(i, next);
  }
}

}  // namespace

std::vector<SeamPlace> find_seams(const Mesh& mesh, const UvCharts& charts, int side) {
  const std::vector<Side> sides = sides_of(mesh, charts);
  std::vector<SeamPlace> out;
  for (std::size_t i = 0, end = 0; i < sides.size(); i = end) {
    for (end = i; end < sides.size() && sides[end].place == sides[i].place;) ++end;
    if (end - i != 2 || !is_seam(mesh, sides[i], sides[i + 1])) continue;
    const auto ends = [&](const Side& s) { return std::pair{mesh.uv1[s.vertex[0]], mesh.uv1[s.vertex[1]]}; };
    const auto [a, b] = ends(sides[i]);
    const auto [c, d] = ends(sides[i + 1]);
    const float texels = static_cast<float>(side) * std::max(length(b - a), length(d - c));
    const int count = 1 + static_cast<int>(std::min(std::ceil(2 * texels), static_cast<float>(kMostPlaces)));
    for (int k = 0; k <= count; ++k) {
      const float t = static_cast<float>(k) / static_cast<float>(count);
      out.push_back({a + (b - a) * t, c + (d - c) * t});
    }
  }
  return out;
}

void stitch_seams(std::span<const SeamPlace> seams, const TexelMap& map, std::span<Vec3f> texels) {
  if (!seams.empty()) Stitching(seams, map).solve(texels);
}

void fill_texels(const TexelMap& map, const UvCharts& charts, std::vector<char> known, std::span<Vec3f> texels) {
  EXPECTS(known.size() == texels.size());
  std::vector<std::uint32_t> chart(texels.size(), kNoChart);
  for (const TexelPlace& p : map.places) chart[p.texel] = charts.of[p.triangle];
  grow(map.side, known, texels,
       [&](std::size_t from, std::size_t to) { return chart[from] != kNoChart && chart[from] == chart[to]; });
  grow(map.side, known, texels, [](std::size_t, std::size_t) { return true; });
}

}  // namespace kiln
