#include "tests/bench/light_field_models.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "core/artifact/import.h"
#include "core/base/random.h"
#include "core/lightfield/lobe_fits.h"
#include "core/mesh/topology.h"
#include "core/prt/direct_transfer.h"
#include "core/sphere/quadrature.h"
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

Vec3f sky_radiance(const Vec3d& w) {
  const Vec3d sun = normalized(Vec3d{0.5, 0.7, 0.4}), lamp = normalized(Vec3d{-0.8, 0.2, 0.5});
  const double s = 12 * std::exp(40 * (dot(w, sun) - 1)), l = 5 * std::exp(60 * (dot(w, lamp) - 1));
  const double up = 0.5 + 0.5 * w.y;
  return to_float(
      Vec3d{s + 0.6 * l + 0.3 + 0.2 * up, 0.9 * s + 0.3 * l + 0.25 + 0.4 * up, 0.7 * s + 0.1 * l + 0.15 + 0.8 * up});
}

std::vector<float> sample_sky() {
  constexpr auto kCount = static_cast<std::size_t>(sh_count(kMaxShOrder));
  std::vector<double> sum(3 * kCount), y(kCount);
  for (const SphereNode& node : sphere_quadrature(60)) {
    const Vec3d& w = node.direction;
    const Vec3f rgb = sky_radiance(w);
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

LightField shine(const Mesh& mesh, int degree, const Coat& under, const Coat& over,
                 const std::function<float(const Vec3f&)>& share, Threads& threads) {
  Scene scene;
  scene.mesh = mesh;
  scene.parts.resize(1);
  scene.materials.resize(1);
  const Tracer tracer(scene, threads);
  const std::vector<TransferPoint> points = vertex_points(scene.mesh);
  const LobeFits fits(degree, threads);
  const LobeFit fit_under = fits.at(under.roughness), fit_over = fits.at(over.roughness);
  const std::vector<SphereNode> nodes = sphere_quadrature(40);
  LightField out{.degree = degree, .coefficients = {}};
  const std::size_t count = out.count();
  out.coefficients.resize(3 * count * mesh.position.size());
  threads.for_blocks(mesh.position.size(), 64, [&](std::size_t begin, std::size_t end) {
    LobeSum sum_under(fit_under), sum_over(fit_over);
    std::vector<float> a(3 * count), b(3 * count);
    for (std::size_t v = begin; v < end; ++v) {
      const Vec3f n = mesh.normal[v];
      const Basis<float> frame = basis_around(n);
      sum_under.clear(), sum_over.clear();
      for (const SphereNode& node : nodes) {
        const Vec3f w = to_float(node.direction);
        if (dot(n, w) <= 0 || tracer.occluded(points[v].position + n * 1e-4F, w, 10)) continue;
        const Vec3f light = sky_radiance(node.direction) * static_cast<float>(node.weight);
        sum_under.add(frame.to_local(w), light);
        sum_over.add(frame.to_local(w), light);
      }
      sum_under.finish(under.f0, under.albedo, 1, a);
      sum_over.finish(over.f0, over.albedo, 1, b);
      const float t = share(mesh.position[v]);
      for (std::size_t i = 0; i < a.size(); ++i) a[i] += t * (b[i] - a[i]);
      for (std::size_t c = 0; c < 3; ++c)
        rotate_sh(degree + 1, frame, a.data() + c * count, out.of(v).data() + c * count);
    }
  });
  return out;
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
