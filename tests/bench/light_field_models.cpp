#include "tests/bench/light_field_models.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "core/artifact/import.h"
#include "core/base/random.h"
#include "core/lightfield/hemisphere_norm.h"
#include "core/mesh/closest_point.h"
#include "core/mesh/topology.h"
#include "core/prt/direct_transfer.h"
#include "core/sphere/quadrature.h"
#include "core/sphere/sampling.h"
#include "core/trace/tracer.h"

namespace kiln::bench {
namespace {

void smooth_normals(Mesh& mesh) {
  mesh.normal.assign(mesh.position.size(), {});
  for (const Triangle& t : mesh.triangles) {
    for (const std::uint32_t v : t) mesh.normal[v] += area_vector(mesh, t);
  }
  for (Vec3f& n : mesh.normal) n = normalized(n);
}

/// Joins vertices in one place.
void weld(Mesh& mesh) {
  const std::vector<std::uint32_t> place = weld_by_position(mesh.position);
  LitMesh lit{.mesh = {.position = mesh.position, .normal = mesh.normal, .triangles = mesh.triangles},
              .field = {.degree = 0, .coefficients = std::vector<float>(3 * mesh.position.size())}};
  for (Triangle& t : lit.mesh.triangles)
    for (std::uint32_t& v : t) v = place[v];
  std::erase_if(lit.mesh.triangles, [](const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
  drop_unused_vertices(lit);
  mesh = std::move(lit.mesh);
  mesh.part.assign(mesh.triangles.size(), 0);
}

}  // namespace

std::vector<float> sample_sky() {
  constexpr auto kCount = static_cast<std::size_t>(sh_count(kMaxShOrder));
  std::vector<double> sum(3 * kCount), y(kCount);
  const Vec3d sun = normalized(Vec3d{0.5, 0.7, 0.4}), lamp = normalized(Vec3d{-0.8, 0.2, 0.5});
  for (const SphereNode& node : sphere_quadrature(60)) {
    const Vec3d& w = node.direction;
    const double s = 12 * std::exp(40 * (dot(w, sun) - 1)), l = 5 * std::exp(60 * (dot(w, lamp) - 1));
    const double up = 0.5 + 0.5 * w.y;
    const double rgb[] = {s + 0.6 * l + 0.3 + 0.2 * up, 0.9 * s + 0.3 * l + 0.25 + 0.4 * up,
                          0.7 * s + 0.1 * l + 0.15 + 0.8 * up};
    evaluate_sh(kMaxShOrder, w, y.data());
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t i = 0; i < kCount; ++i) sum[c * kCount + i] += node.weight * rgb[c] * y[i];
  }
  return {sum.begin(), sum.end()};
}

LightField paint_light(const Mesh& mesh, int degree, double blur, const std::function<Paint(const Vec3f&)>& paint) {
  const std::vector<float> sky = sample_sky();
  const auto all = static_cast<std::size_t>(sh_count(kMaxShOrder));
  LightField field{.degree = degree, .coefficients = {}};
  const std::size_t count = field.count();
  field.coefficients.resize(3 * count * mesh.position.size());
  std::vector<float> transfer(all);
  const auto y0 = static_cast<float>(std::sqrt(1 / (4 * std::numbers::pi)));
  for (std::size_t v = 0; v < mesh.position.size(); ++v) {
    const Paint here = paint(mesh.position[v]);
    clamped_cosine_transfer(kMaxShOrder, mesh.normal[v], transfer.data());
    const auto out = field.of(v);
    for (std::size_t c = 0; c < 3; ++c) {
      float diffuse = 0;
      for (std::size_t i = 0; i < all; ++i) diffuse += transfer[i] * sky[c * all + i];
      for (int l = 0; l <= degree; ++l) {
        const auto h = here.gloss * static_cast<float>(std::exp(-blur * l * (l + 1)));
        for (auto i = static_cast<std::size_t>(l * l); i < static_cast<std::size_t>((l + 1) * (l + 1)); ++i)
          out[c * count + i] = h * sky[c * all + i];
      }
      out[c * count] += here.albedo[c] * diffuse / y0;
    }
  }
  return field;
}

Mesh relief_torus(std::uint32_t n) {
  constexpr double kTurn = 2 * std::numbers::pi;
  Mesh mesh;
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint32_t k = 0; k < 2 * n; ++k) {
      const double u = kTurn * k / (2 * n), v = kTurn * i / n;
      double relief = 0;
      for (int octave = 0; octave < 6; ++octave) {
        const double f = 5 * std::pow(2.0, octave);
        relief += std::sin(std::round(f) * u + 1.3 * octave) * std::cos(std::round(0.6 * f) * v) / (f * std::sqrt(f));
      }
      const double r = 0.12 + 0.06 * relief, ring = 0.32 + r * std::cos(v);
      mesh.position.push_back(to_float(Vec3d{ring * std::cos(u), ring * std::sin(u), r * std::sin(v)}));
    }
  }
  const auto at = [&](std::uint32_t i, std::uint32_t k) { return i % n * 2 * n + k % (2 * n); };
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint32_t k = 0; k < 2 * n; ++k) {
      mesh.triangles.push_back({at(i, k), at(i, k + 1), at(i + 1, k + 1)});
      mesh.triangles.push_back({at(i, k), at(i + 1, k + 1), at(i + 1, k)});
    }
  }
  mesh.part.assign(mesh.triangles.size(), 0);
  smooth_normals(mesh);
  return mesh;
}

Mesh cube_sphere(std::uint32_t n) {
  Mesh mesh;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      const auto first = static_cast<std::uint32_t>(mesh.position.size());
      for (std::uint32_t i = 0; i <= n; ++i) {
        for (std::uint32_t k = 0; k <= n; ++k) {
          Vec3d p;
          p[axis] = side;
          p[(axis + (side > 0 ? 1 : 2)) % 3] = std::tan(0.25 * std::numbers::pi * (2.0 * i / n - 1));
          p[(axis + (side > 0 ? 2 : 1)) % 3] = std::tan(0.25 * std::numbers::pi * (2.0 * k / n - 1));
          mesh.position.push_back(to_float(normalized(p) * 0.5));
        }
      }
      const auto at = [&](std::uint32_t i, std::uint32_t k) { return first + i * (n + 1) + k; };
      for (std::uint32_t i = 0; i < n; ++i) {
        for (std::uint32_t k = 0; k < n; ++k) {
          mesh.triangles.push_back({at(i, k), at(i + 1, k), at(i + 1, k + 1)});
          mesh.triangles.push_back({at(i, k), at(i + 1, k + 1), at(i, k + 1)});
        }
      }
    }
  }
  for (const Vec3f& p : mesh.position) mesh.normal.push_back(normalized(p));
  weld(mesh);
  return mesh;
}

Mesh load_model(const std::string& path) {
  const auto files = read_scene_files(path);
  const auto scene = files ? import_scene(*files) : tl::make_unexpected(files.error());
  if (!scene) {
    std::fprintf(stderr, "%s: %s\n", scene.error().where.c_str(), scene.error().message.c_str());
    return {};
  }
  Mesh mesh = scene->mesh;
  mesh.uv0.clear(), mesh.uv1.clear(), mesh.color.clear(), mesh.tangent.clear();
  weld(mesh);
  smooth_normals(mesh);
  return mesh;
}

LightField bake_colours(const Mesh& mesh, Threads& threads) {
  Scene scene;
  scene.mesh = mesh;
  scene.parts.resize(1);
  scene.materials.resize(1);
  const Tracer tracer(scene, threads);
  const std::vector<TransferPoint> points = vertex_points(scene.mesh);
  const auto transfer = bake_direct_transfer(tracer, points, {.order = 6, .samples = 1024}, threads);
  const std::vector<float> sky = sample_sky();
  const auto all = static_cast<std::size_t>(sh_count(kMaxShOrder));
  const auto y0 = static_cast<float>(std::sqrt(1 / (4 * std::numbers::pi)));
  LightField out{.degree = 0, .coefficients = {}};
  for (std::size_t v = 0; v < points.size(); ++v) {
    for (std::size_t c = 0; c < 3; ++c) {
      float sum = 0;
      for (std::size_t i = 0; i < 36; ++i) sum += transfer[36 * v + i] * sky[c * all + i];
      out.coefficients.push_back(sum / y0);
    }
  }
  return out;
}

namespace {

constexpr std::size_t kPoints = 40'000;

struct Sampled {
  std::uint32_t triangle;
  Vec3d weights;
};

/// Uniform by area.
std::vector<Sampled> sample_surface(const Mesh& mesh, std::uint64_t seed) {
  std::vector<double> sum;
  double total = 0;
  for (const Triangle& t : mesh.triangles) sum.push_back(total += triangle_area(mesh, t));
  std::vector<Sampled> out;
  for (std::size_t i = 0; i < kPoints; ++i) {
    Random random(seed, i);
    const auto at = std::upper_bound(sum.begin(), sum.end(), random.uniform_double() * total) - sum.begin();
    const Vec2d uv = uniform_triangle({random.uniform_double(), random.uniform_double()});
    out.push_back(
        {static_cast<std::uint32_t>(std::min<std::ptrdiff_t>(at, std::ssize(sum) - 1)), {1 - uv.x - uv.y, uv.x, uv.y}});
  }
  return out;
}

Vec3d mix(const std::vector<Vec3f>& values, const Triangle& t, const Vec3d& w) {
  return to_double(values[t[0]]) * w.x + to_double(values[t[1]]) * w.y + to_double(values[t[2]]) * w.z;
}

std::vector<double> mix(const LightField& field, const Triangle& t, const Vec3d& w) {
  std::vector<double> out(3 * field.count());
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t i = 0; i < out.size(); ++i) out[i] += w[c] * field.of(t[c])[i];
  return out;
}

/// A field of a lower degree is one of this degree with zeros.
std::vector<double> widened(const std::vector<double>& c, std::size_t count) {
  const std::size_t own = c.size() / 3;
  std::vector<double> out(3 * count);
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t i = 0; i < own; ++i) out[k * count + i] = c[k * own + i];
  return out;
}

/// Mean squared distance of points of `from` from `to`; `visit(place on from, nearest on to)`.
template <class Visit>
double mean_squared_distance(const Mesh& from, const Mesh& to, const Visit& visit) {
  const ClosestPoint closest(to);
  double sum = 0;
  for (const Sampled& s : sample_surface(from, 1)) {
    const Triangle& t = from.triangles[s.triangle];
    const Vec3d p = mix(from.position, t, s.weights), n = mix(from.normal, t, s.weights);
    auto match = closest.query(p, n);
    if (!match) match = closest.query(p, {});
    sum += match->distance * match->distance;
    visit(s, *match);
  }
  return sum / static_cast<double>(kPoints);
}

}  // namespace

LightFieldError compare(const LitMesh& truth, const LitMesh& found, Threads&) {
  const HemisphereNorm norm(truth.field.degree);
  double difference = 0, size = 0;
  const double there = mean_squared_distance(truth.mesh, found.mesh, [&](const Sampled& s, const SurfaceMatch& m) {
    const Triangle& t = truth.mesh.triangles[s.triangle];
    const Vec3d n = normalized(mix(truth.mesh.normal, t, s.weights));
    std::vector<double> a = mix(truth.field, t, s.weights);
    const std::vector<double> b =
        widened(mix(found.field, found.mesh.triangles[m.triangle], {1 - m.u - m.v, m.u, m.v}), truth.field.count());
    size += squared_norm(norm, n, a);
    for (std::size_t i = 0; i < a.size(); ++i) a[i] -= b[i];
    difference += squared_norm(norm, n, a);
  });
  const double back = mean_squared_distance(found.mesh, truth.mesh, [](const Sampled&, const SurfaceMatch&) {});
  Vec3f low = truth.mesh.position[0], high = low;
  for (const Vec3f& p : truth.mesh.position)
    for (std::size_t a = 0; a < 3; ++a) low[a] = std::min(low[a], p[a]), high[a] = std::max(high[a], p[a]);
  return {.light = std::sqrt(difference / size),
          .distance = 100 * std::sqrt(0.5 * (there + back)) / length(to_double(high) - to_double(low))};
}

float noise(const Vec3f& p, float scale) {
  const Vec3f q = p * (1 / scale);
  const Vec3f cell{std::floor(q.x), std::floor(q.y), std::floor(q.z)};
  const auto smooth = [](float t) { return t * t * (3 - 2 * t); };
  const Vec3f f{smooth(q.x - cell.x), smooth(q.y - cell.y), smooth(q.z - cell.z)};
  float sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int dx = corner & 1, dy = corner >> 1 & 1, dz = corner >> 2;
    const auto lattice = [](float x, int d) {
      return static_cast<std::uint64_t>(static_cast<std::int64_t>(x) + d + 4096);
    };
    const std::uint64_t id = (lattice(cell.x, dx) << 40) ^ (lattice(cell.y, dy) << 20) ^ lattice(cell.z, dz);
    const float value = static_cast<float>(mix64(id) >> 40) * 0x1p-24F;
    sum += value * (dx ? f.x : 1 - f.x) * (dy ? f.y : 1 - f.y) * (dz ? f.z : 1 - f.z);
  }
  return sum;
}

}  // namespace kiln::bench
