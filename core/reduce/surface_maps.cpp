#include "core/reduce/surface_maps.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/index_table.h"
#include "core/base/random.h"

namespace kiln {
namespace {

constexpr double kCrease = 0.7071067811865476;  // 45 degrees
constexpr double kFlattest = 0.05;              // cosine of the steepest normal that a map may hold
constexpr int kDiffusions = 8;

/// Vertices around which triangles stand, as lists.
struct Fans {
  std::vector<std::uint32_t> first, triangle;
  explicit Fans(const Surface& s) : first(s.position.size() + 1), triangle(3 * s.triangles.size()) {
    for (const Triangle& t : s.triangles) {
      for (const std::uint32_t v : t) ++first[v + 1];
    }
    for (std::size_t v = 1; v < first.size(); ++v) first[v] += first[v - 1];
    std::vector<std::uint32_t> at(first.begin(), first.end() - 1);
    for (std::uint32_t t = 0; t < s.triangles.size(); ++t) {
      for (const std::uint32_t v : s.triangles[t]) triangle[at[v]++] = t;
    }
  }
};

Vec3d area_of(const Surface& s, std::uint32_t t) {
  const auto& [a, b, c] = s.triangles[t];
  return cross(s.position[b] - s.position[a], s.position[c] - s.position[a]);
}

/// Interpolated frame of a viewer: columns of the matrix that takes a map's normal to the unit cube.
struct ViewFrame {
  Vec3d tangent, bitangent, normal;

  ViewFrame(const Mesh& mesh, std::uint32_t triangle, double u, double v) {
    const Triangle& t = mesh.triangles[triangle];
    const double weight[] = {1 - u - v, u, v};
    Vec3d n, x, y;
    for (std::size_t c = 0; c < 3; ++c) {
      const Vec3d nc = to_double(mesh.normal[t[c]]);
      n += nc * weight[c];
      if (mesh.tangent.empty()) continue;
      const Vec4f& tc = mesh.tangent[t[c]];
      const Vec3d xc{tc.x, tc.y, tc.z};
      x += xc * weight[c];
      y += cross(nc, xc) * (tc.w * weight[c]);
    }
    normal = normalized(n), tangent = normalized(x), bitangent = normalized(y);
  }
  Vec3d to_unit(const Vec3d& m) const { return tangent * m.x + bitangent * m.y + normal * m.z; }
  /// The direction whose to_unit is along `n`.
  Vec3d to_map(const Vec3d& n) const {
    const double det = dot(tangent, cross(bitangent, normal));
    if (!(std::abs(det) > 1e-6)) return {0, 0, 1};
    const Vec3d m = normalized(Vec3d{dot(n, cross(bitangent, normal)) / det, dot(tangent, cross(n, normal)) / det,
                                     dot(tangent, cross(bitangent, n)) / det},
                               Vec3d{0, 0, 1});
    return m.z >= kFlattest ? m : normalized(Vec3d{m.x, m.y, kFlattest}, Vec3d{0, 0, 1});
  }
};

/// What a texel holds on its way into the textures.
struct Cell {
  Vec3f normal, color;
  float weight = 0;
};

struct Picture {
  int width = 0, height = 0;
  std::vector<Cell> cells;
  Picture(int w, int h) : width(w), height(h), cells(static_cast<std::size_t>(w) * static_cast<std::size_t>(h)) {}
  Cell& at(int x, int y) {
    return cells[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
  }
  const Cell& at(int x, int y) const {
    return cells[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
  }
};

/// Fills cells of weight 0: each from the picture of half the size, which holds weighted means.
void fill(Picture& p) {
  if (p.width == 1 && p.height == 1) return;
  Picture half((p.width + 1) / 2, (p.height + 1) / 2);
  for (int y = 0; y < p.height; ++y) {
    for (int x = 0; x < p.width; ++x) {
      const Cell& from = p.at(x, y);
      Cell& to = half.at(x / 2, y / 2);
      to.normal += from.normal * from.weight, to.color += from.color * from.weight;
      to.weight += from.weight;
    }
  }
  for (Cell& c : half.cells) {
    if (c.weight <= 0) continue;
    c.normal *= 1 / c.weight, c.color *= 1 / c.weight;
    c.weight = std::min(c.weight, 1.0F);
  }
  fill(half);
  for (int y = 0; y < p.height; ++y) {
    for (int x = 0; x < p.width; ++x) {
      Cell& to = p.at(x, y);
      if (to.weight > 0) continue;
      const Cell& from = half.at(x / 2, y / 2);
      to.normal = from.normal, to.color = from.color;
    }
  }
}

/// Cells that were filled become the mean of their neighbours, a few times.
void diffuse(Picture& p) {
  Picture next = p;
  for (int pass = 0; pass < kDiffusions; ++pass) {
    for (int y = 0; y < p.height; ++y) {
      for (int x = 0; x < p.width; ++x) {
        if (p.at(x, y).weight > 0) continue;
        Cell& to = next.at(x, y);
        to = {};
        float n = 0;
        for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
          if (x + dx < 0 || y + dy < 0 || x + dx >= p.width || y + dy >= p.height) continue;
          to.normal += p.at(x + dx, y + dy).normal, to.color += p.at(x + dx, y + dy).color;
          ++n;
        }
        to.normal *= 1 / std::max(n, 1.0F), to.color *= 1 / std::max(n, 1.0F);
      }
    }
    p.cells.swap(next.cells);
    if (pass == 0) next.cells = p.cells;
  }
}

std::uint8_t byte_of(double x) { return static_cast<std::uint8_t>(std::clamp(std::lround(255 * x), 0L, 255L)); }

double to_srgb(double x) { return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055; }

class MapMaker {
 public:
  MapMaker(const Mesh& mesh, const Atlas& atlas, const std::vector<Texel>& texels, SurfaceMaps& out)
      : mesh_(mesh), atlas_(atlas), texels_(texels), out_(out) {}

  /// How many of the chart's texels had to be filled, and how many there are.
  std::pair<std::size_t, std::size_t> make(const Chart& chart) const {
    Picture picture(chart.width, chart.height);
    const auto [covered, hit] = gather(chart, picture);
    if (hit == 0) {
      for (Cell& c : picture.cells) c = {{0, 0, 1}, mean_color(chart), 0};
    } else {
      fill(picture);
      diffuse(picture);
    }
    for (int y = 0; y < chart.height; ++y) {
      for (int x = 0; x < chart.width; ++x) put(chart.x + x, chart.y + y, picture.at(x, y));
    }
    return {covered - hit, covered};
  }

 private:
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(atlas_.side) + static_cast<std::size_t>(x);
  }

  /// Texels that a triangle covers, or nearly, take what fell into them. Where two do, the one that is more inside.
  std::pair<std::size_t, std::size_t> gather(const Chart& chart, Picture& picture) const {
    constexpr float kOutside = 1e9F;
    std::vector<float> outside(picture.cells.size(), kOutside);
    for (const std::uint32_t t : chart.triangles) {
      std::array<Vec2<double>, 3> p;
      for (std::size_t c = 0; c < 3; ++c) {
        p[c] = chart.texel(to_double(mesh_.position[mesh_.triangles[t][c]]), atlas_.density, atlas_.padding);
        p[c].x -= chart.x, p[c].y -= chart.y;
      }
      cover(chart, t, p, picture, outside);
    }
    std::size_t covered = 0, hit = 0;
    for (std::size_t i = 0; i < outside.size(); ++i) {
      covered += outside[i] <= 0 ? 1 : 0;
      hit += outside[i] <= 0 && picture.cells[i].weight > 0 ? 1 : 0;
    }
    return {covered, hit};
  }

  void cover(const Chart& chart, std::uint32_t t, const std::array<Vec2<double>, 3>& p, Picture& picture,
             std::vector<float>& outside) const {
    const double area = (p[1].x - p[0].x) * (p[2].y - p[0].y) - (p[1].y - p[0].y) * (p[2].x - p[0].x);
    if (!(std::abs(area) > 1e-9)) return;
    const auto range = [](double a, double b, double c, int size) {
      return std::pair{std::max(0, static_cast<int>(std::floor(std::min({a, b, c}) - 1.5))),
                       std::min(size - 1, static_cast<int>(std::ceil(std::max({a, b, c}) + 0.5)))};
    };
    const auto [x0, x1] = range(p[0].x, p[1].x, p[2].x, chart.width);
    const auto [y0, y1] = range(p[0].y, p[1].y, p[2].y, chart.height);
    for (int y = y0; y <= y1; ++y) {
      for (int x = x0; x <= x1; ++x) {
        const double dx = x + 0.5 - p[0].x, dy = y + 0.5 - p[0].y;
        double w[3];
        w[1] = (dx * (p[2].y - p[0].y) - dy * (p[2].x - p[0].x)) / area;
        w[2] = ((p[1].x - p[0].x) * dy - (p[1].y - p[0].y) * dx) / area;
        w[0] = 1 - w[1] - w[2];
        double out = 0;  // texels beyond an edge
        for (std::size_t c = 0; c < 3; ++c) {
          const auto &a = p[(c + 1) % 3], &b = p[(c + 2) % 3];
          const double edge = std::hypot(b.x - a.x, b.y - a.y);
          if (w[c] < 0 && edge > 0) out = std::max(out, -w[c] * std::abs(area) / edge);
        }
        const std::size_t i =
            static_cast<std::size_t>(y) * static_cast<std::size_t>(chart.width) + static_cast<std::size_t>(x);
        if (out > 1 || out >= outside[i]) continue;
        outside[i] = static_cast<float>(out);
        take(chart, t, x, y, w, picture);
      }
    }
  }

  void take(const Chart& chart, std::uint32_t t, int x, int y, double (&w)[3], Picture& picture) const {
    Cell& cell = picture.at(x, y);
    cell = {};
    const Texel& texel = texels_[index(chart.x + x, chart.y + y)];
    if (!(texel.weight > 0)) return;
    double sum = 0;
    for (double& c : w) sum += c = std::max(c, 0.0);
    const ViewFrame frame(mesh_, t, w[1] / sum, w[2] / sum);
    const Vec3d n = to_double(texel.normal);
    cell.normal = length(n) > 0 ? to_float(frame.to_map(normalized(n))) : Vec3f{0, 0, 1};
    cell.color = texel.color * (1 / texel.weight);
    cell.weight = 1;
  }

  Vec3f mean_color(const Chart& chart) const {
    if (mesh_.color.empty()) return {1, 1, 1};
    Vec3f sum;
    for (const std::uint32_t t : chart.triangles) {
      for (const std::uint32_t v : mesh_.triangles[t])
        sum += Vec3f{mesh_.color[v].x, mesh_.color[v].y, mesh_.color[v].z};
    }
    return sum * (1.0F / (3.0F * static_cast<float>(chart.triangles.size())));
  }

  void put(int x, int y, const Cell& cell) const {
    const Vec3d n = normalized(to_double(cell.normal), Vec3d{0, 0, 1});
    const std::size_t at = 3 * index(x, y);
    for (std::size_t c = 0; c < 3; ++c) {
      put_normal(at + c, 0.5 * n[c] + 0.5);
      if (!out_.color.empty()) out_.color[at + c] = byte_of(to_srgb(std::clamp(double{cell.color[c]}, 0.0, 1.0)));
    }
  }

  void put_normal(std::size_t at, double share) const {
    if (out_.normal_bits == 8) {
      out_.normal[at] = byte_of(share);
      return;
    }
    const auto value = static_cast<unsigned>(std::lround(65535 * std::clamp(share, 0.0, 1.0)));
    out_.normal[2 * at] = static_cast<std::uint8_t>(value >> 8);
    out_.normal[2 * at + 1] = static_cast<std::uint8_t>(value & 255U);
  }

  const Mesh& mesh_;
  const Atlas& atlas_;
  const std::vector<Texel>& texels_;
  SurfaceMaps& out_;
};

/// A stored value, from -1 to 1.
double normal_value(const SurfaceMaps& maps, std::size_t at) {
  if (maps.normal_bits == 8) return maps.normal[at] / 127.5 - 1;
  return (256 * maps.normal[2 * at] + maps.normal[2 * at + 1]) / 32767.5 - 1;
}

/// Bilinear, as a sampler without mip maps does it.
Vec3d map_normal(const SurfaceMaps& maps, const Vec2<double>& uv) {
  const double x = uv.x * maps.side - 0.5, y = uv.y * maps.side - 0.5;
  const double x0 = std::floor(x), y0 = std::floor(y), fx = x - x0, fy = y - y0;
  const auto texel = [&](double i, double j) {
    const auto at = [&](double k) { return static_cast<std::size_t>(std::clamp(k, 0.0, maps.side - 1.0)); };
    const std::size_t p = 3 * (at(j) * static_cast<std::size_t>(maps.side) + at(i));
    return Vec3d{normal_value(maps, p), normal_value(maps, p + 1), normal_value(maps, p + 2)};
  };
  return (texel(x0, y0) * (1 - fx) + texel(x0 + 1, y0) * fx) * (1 - fy) +
         (texel(x0, y0 + 1) * (1 - fx) + texel(x0 + 1, y0 + 1) * fx) * fy;
}

}  // namespace

Mesh delivered_mesh(const Surface& s, const Atlas* atlas, bool colors) {
  const Fans fans(s);
  Mesh mesh;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> keys;  // vertex, chart
  IndexTable table;
  const auto hash = [&](std::uint32_t i) { return mix64(std::uint64_t{keys[i].first} << 32 | keys[i].second); };
  const auto normal = [&](std::uint32_t v, std::uint32_t chart) {
    Vec3d own, sum;
    for (std::uint32_t i = fans.first[v]; i < fans.first[v + 1]; ++i) {
      if (!atlas || atlas->chart_of[fans.triangle[i]] == chart) own += area_of(s, fans.triangle[i]);
    }
    for (std::uint32_t i = fans.first[v]; atlas && i < fans.first[v + 1]; ++i) {
      const Vec3d area = area_of(s, fans.triangle[i]);
      if (dot(area, own) > kCrease * length(area) * length(own)) sum += area;
    }
    return normalized(sum, normalized(own));
  };
  const auto vertex = [&](std::uint32_t v, std::uint32_t chart) {
    const std::pair key{v, chart};
    std::uint32_t i =
        table.find(mix64(std::uint64_t{v} << 32 | chart), [&](std::uint32_t k) { return keys[k] == key; });
    if (i != IndexTable::kNone) return i;
    i = static_cast<std::uint32_t>(keys.size());
    keys.push_back(key);
    table.add(i, hash);
    const Vec3d n = normal(v, chart);
    mesh.position.push_back(to_float(s.position[v]));
    mesh.normal.push_back(to_float(n));
    if (colors) {
      const Vec3f c = s.sample[v].mean_color();
      mesh.color.push_back({c.x, c.y, c.z, 1});
    }
    if (!atlas) return i;
    const Chart& c = atlas->charts[chart];
    const Vec3f t = to_float(normalized(c.tangent - n * dot(c.tangent, n), basis_around(n).x));
    mesh.tangent.push_back({t.x, t.y, t.z, 1});
    const auto texel = c.texel(s.position[v], atlas->density, atlas->padding);
    mesh.uv0.push_back({static_cast<float>(texel.x / atlas->side), static_cast<float>(texel.y / atlas->side)});
    return i;
  };
  for (std::uint32_t t = 0; t < s.triangles.size(); ++t) {
    const std::uint32_t chart = atlas ? atlas->chart_of[t] : 0;
    const auto& [a, b, c] = s.triangles[t];
    mesh.triangles.push_back({vertex(a, chart), vertex(b, chart), vertex(c, chart)});
  }
  mesh.part.assign(mesh.triangles.size(), 0);
  return mesh;
}

SurfaceMaps make_maps(const Mesh& mesh, const Atlas& atlas, const std::vector<Texel>& texels, bool colors,
                      int normal_bits, Threads& threads) {
  SurfaceMaps out{.side = atlas.side, .normal_bits = normal_bits};
  const std::size_t pixels = static_cast<std::size_t>(atlas.side) * static_cast<std::size_t>(atlas.side);
  const auto bytes = static_cast<std::size_t>(normal_bits / 8);
  out.normal.assign(3 * bytes * pixels, 255);
  for (std::size_t i = 0; i < pixels; ++i) {  // straight up, as nearly as zero can be said
    for (std::size_t k = 0; k < 2 * bytes; ++k) out.normal[3 * bytes * i + k] = k % bytes == 0 ? 128 : 0;
  }
  if (colors) out.color.assign(3 * pixels, 128);
  std::vector<std::pair<std::size_t, std::size_t>> counts(atlas.charts.size());
  const MapMaker maker(mesh, atlas, texels, out);
  threads.for_blocks(atlas.charts.size(), 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c) counts[c] = maker.make(atlas.charts[c]);
  });
  std::size_t filled = 0, covered = 0;
  for (const auto& [f, c] : counts) filled += f, covered += c;
  out.filled = covered > 0 ? static_cast<double>(filled) / static_cast<double>(covered) : 0;
  return out;
}

double normal_error(const Mesh& mesh, const SurfaceMaps* maps, const std::vector<NormalProbe>& probes) {
  double sum = 0, weight = 0;
  for (const NormalProbe& probe : probes) {
    const ViewFrame frame(mesh, probe.triangle, probe.u, probe.v);
    Vec3d shown = frame.normal;
    if (maps) {
      const Triangle& t = mesh.triangles[probe.triangle];
      const double w[] = {1.0 - probe.u - probe.v, probe.u, probe.v};
      Vec2<double> uv;
      for (std::size_t c = 0; c < 3; ++c) uv.x += w[c] * mesh.uv0[t[c]].x, uv.y += w[c] * mesh.uv0[t[c]].y;
      shown = normalized(frame.to_unit(map_normal(*maps, uv)));
    }
    const double angle = std::acos(std::clamp(dot(shown, to_double(probe.normal)), -1.0, 1.0));
    sum += probe.weight * angle * angle;
    weight += probe.weight;
  }
  constexpr double kDegrees = 57.29577951308232;
  return weight > 0 ? kDegrees * std::sqrt(sum / weight) : 0;
}

}  // namespace kiln
