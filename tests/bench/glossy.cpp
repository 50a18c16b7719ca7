// Where the error of matrices comes from, at random points with random eyes on the surface that has them, under the
// certificate's lightings. relRMSE of specular radiance; one JSON line for each case:
//   bands n      what n bands of the lobe show of all that arrives, path-traced, against the lobe itself: truncation
//   point        a matrix of very many rays at the very point, against what its bands show of all that arrives
//   noise        as many rays as the bake takes, at the point   |
//   vertices     very many rays, but at the corners             | against `point`
//   delivered    the file as it is                              |
//   kiln_glossy INPUT.glb BAKED/scene.glb [paths] [points]

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <numbers>
#include <string>

#include "core/artifact/eye.h"
#include "core/artifact/import.h"
#include "core/bake/error_stats.h"
#include "core/bake/eye_material.h"
#include "core/bake/lightings.h"
#include "core/base/random.h"
#include "core/mesh/closest_point.h"
#include "core/mesh/topology.h"
#include "core/prt/glossy_matrix.h"
#include "core/sphere/quadrature.h"
#include "core/trace/reference.h"
#include "core/trace/surface_samples.h"

namespace kiln::bench {
namespace {

constexpr int kMany = 16384;  // rays of a matrix without noise
constexpr int kBake = 512;
constexpr double kRidge = 0.01;  // as lobe_table.cpp

struct Seen {
  EyePoint eye;
  EyedPoint truth;
  TransferPoint here;
};

std::vector<Seen> open_eyes(const BakedScene& baked, const Scene& input, std::size_t count) {
  const Mesh& mesh = baked.scene.mesh;
  std::vector<double> density;
  for (const Triangle& t : mesh.triangles) density.push_back(has_matrices(baked.glossy, t) ? 1 : 0);
  const ClosestPoint nearest(input.mesh);
  std::vector<Seen> out;
  for (const SurfaceSample& s : sample_surface(mesh, count, 77, density)) {
    Random random(77, out.size());
    const SurfaceMatch here{s.triangle, s.u, s.v, 0};
    const Vec3d normal = match_normal(mesh, here), view = random_view(normal, random);
    const auto match = nearest.query(match_position(mesh, here), normal);
    if (!match) continue;
    const EyeMaterial material = eye_material(baked.scene, surface_point(baked.scene, s.triangle, s.u, s.v));
    const Vec3f face = normalized(area_vector(mesh, mesh.triangles[s.triangle]), to_float(normal));
    const Vec3f position = to_float(match_position(mesh, here));
    out.push_back({{{mesh.triangles[s.triangle], s.u, s.v}, normal, view, material},
                   {{to_float(match_position(input.mesh, *match)), to_float(normal), face},
                    to_float(view),
                    ggx_alpha(material.roughness),
                    {1, 1, 1}},
                   {position, to_float(normal), centroid(mesh, mesh.triangles[s.triangle]), face}});
  }
  return out;
}

/// The lobe in n bands as lobe_table.h fits it, but solved for this very point, and times its albedo for F0 = 1.
std::vector<double> fitted_kernel(int order, const EyedPoint& point) {
  const auto count = static_cast<std::size_t>(sh_count(order));
  const auto size = static_cast<Eigen::Index>(count);
  Eigen::MatrixXd above = Eigen::MatrixXd::Identity(size, size) * kRidge;
  Eigen::VectorXd y(size), moments = Eigen::VectorXd::Zero(size);
  for (const QuadratureNode& node : gauss_legendre(2 * order)) {
    const double z = (node.x + 1) / 2, r = std::sqrt(1 - z * z);
    for (int k = 0; k < 2 * order + 2; ++k) {
      const double phi = 2 * std::numbers::pi * (k + 0.5) / (2 * order + 2);
      evaluate_sh(order, Vec3d{r * std::cos(phi), r * std::sin(phi), z}, y.data());
      above += y * y.transpose() * (node.weight * std::numbers::pi / (2 * order + 2));
    }
  }
  const Basis<float> frame = basis_around(point.at.normal);
  const Basis<double> basis{to_double(frame.x), to_double(frame.y), to_double(frame.z)};
  const Vec3d view = basis.to_local(to_double(point.view));
  constexpr int kSide = 48;
  double all = 0;
  for (int i = 0; i < kSide * kSide; ++i) {
    const GgxSample s = sample_ggx(point.alpha, view, {(i / kSide + 0.5) / kSide, (i % kSide + 0.5) / kSide});
    if (!(s.weight > 0)) continue;
    evaluate_sh(order, s.l, y.data());
    moments += y * s.weight;
    all += s.weight;
  }
  const Eigen::VectorXd weight = above.ldlt().solve(moments);
  const double constant = weight.dot(above.col(0)) * 2 * std::sqrt(std::numbers::pi);  // the ridge is 1e-3 of it
  std::vector<float> local(count);
  for (std::size_t i = 0; i < count; ++i)
    local[i] = static_cast<float>(weight[static_cast<Eigen::Index>(i)] / constant * all / (kSide * kSide));
  rotate_sh(order, frame, local.data(), local.data());
  return {local.begin(), local.end()};
}

void print(const std::string& name, const ErrorStats& stats) {
  std::printf("{\"case\": \"%s\", \"relrmse\": %.4f, \"interval\": [%.4f, %.4f], \"bias\": %.4f, \"noise\": %.4f}\n",
              name.c_str(), stats.relrmse, stats.interval_low, stats.interval_high, stats.bias, stats.noise);
  std::fflush(stdout);
}

/// What matrices at given places show: light that arrives, in the lobe's kernel.
class Shown {
 public:
  Shown(const BakedScene& baked, const std::vector<Seen>& seen, const Lightings& lightings)
      : baked_(baked), seen_(seen), lightings_(lightings) {}

  /// arriving(point, light, out): order^2 coefficients.
  template <class Arriving>
  std::vector<Vec3d> under_all(const Arriving& arriving) const {
    std::vector<Vec3d> out;
    for (const auto& light : lightings_.sh) {
      for (std::size_t p = 0; p < seen_.size(); ++p) {
        std::vector<Vec3d> there(static_cast<std::size_t>(sh_count(baked_.glossy.order)));
        arriving(p, light, there.data());
        const EyePoint& eye = seen_[p].eye;
        const Lobe lobe = lobe_at(baked_.lobes, dot(eye.normal, eye.view), eye.material.roughness);
        out.push_back(lobe.albedo({1, 1, 1}) * reflected_light(lobe, eye.normal, eye.view, there.data()));
      }
    }
    return out;
  }

 private:
  const BakedScene& baked_;
  const std::vector<Seen>& seen_;
  const Lightings& lightings_;
};

void add_product(const GlossyTransfer& shape, const std::vector<float>& matrix, const std::vector<Vec3f>& light,
                 double weight, Vec3d* out) {
  const auto outputs = static_cast<std::size_t>(shape.outputs()), inputs = static_cast<std::size_t>(shape.inputs());
  for (std::size_t o = 0; o < outputs; ++o) {
    for (std::size_t c = 0; c < 3; ++c) {
      const float* row = &matrix[((shape.channels == 3 ? c : 0) * outputs + o) * inputs];
      for (std::size_t i = 0; i < outputs; ++i) out[o][c] += weight * row[i] * light[i][c];
    }
  }
}

std::vector<std::vector<float>> matrices(const GlossyMatrixBaker& baker, const std::vector<TransferPoint>& points,
                                         Threads& threads) {
  std::vector<std::vector<float>> out(points.size(), std::vector<float>(baker.stride()));
  threads.for_blocks(points.size(), 1, [&](std::size_t i, std::size_t) { baker.bake(points[i], out[i].data()); });
  return out;
}

ErrorStats against(const std::vector<Vec3d>& values, const std::vector<Vec3d>& reference, std::size_t points) {
  return compute_error({values, reference, {}, points}, {.seed = 1});
}

void split_transport(const BakedScene& baked, const Lightings& lightings, const std::vector<Seen>& seen,
                     const ReferenceResult& bands, Threads& threads) {
  const GlossyTransfer& g = baked.glossy;
  const Tracer tracer(baked.scene, threads);
  GlossyMatrix params{.order = g.order, .channels = g.channels, .fixed = g.fixed, .reflected = true};
  params.samples = kMany;
  const GlossyMatrixBaker many(tracer, baked.transfer, params);
  params.samples = kBake;
  const GlossyMatrixBaker few(tracer, baked.transfer, params);
  const std::vector<TransferPoint> at_vertices = vertex_points(baked.scene.mesh);
  std::vector<TransferPoint> here, corners;
  for (const Seen& s : seen) {
    here.push_back(s.here);
    for (const auto v : s.eye.place.triangle) corners.push_back(at_vertices[v]);
  }
  const Shown shown(baked, seen, lightings);
  const auto at_points = [&](const std::vector<std::vector<float>>& m) {
    return shown.under_all(
        [&](std::size_t p, const std::vector<Vec3f>& light, Vec3d* out) { add_product(g, m[p], light, 1, out); });
  };
  const std::vector<Vec3d> point = at_points(matrices(many, here, threads));
  print("point",
        compute_error({point, bands.value, noise_from_halves(bands.half_a, bands.half_b), seen.size()}, {.seed = 1}));
  print("noise", against(at_points(matrices(few, here, threads)), point, seen.size()));
  const auto interpolated = matrices(many, corners, threads);
  print("vertices", against(shown.under_all([&](std::size_t p, const std::vector<Vec3f>& light, Vec3d* out) {
          const TrianglePoint& place = seen[p].eye.place;
          const double weight[] = {1 - double{place.u} - place.v, place.u, place.v};
          for (std::size_t k = 0; k < 3; ++k) add_product(g, interpolated[3 * p + k], light, weight[k], out);
        }),
                            point, seen.size()));
  std::vector<Vec3d> delivered;
  for (const auto& light : lightings.sh) {
    std::vector<Vec3f> padded = light;
    padded.resize(static_cast<std::size_t>(sh_count(baked.transfer.order)));
    const EyeLight own = eye_light(baked, std::move(padded), false);
    for (const Seen& s : seen) {
      EyePoint eye = s.eye;
      eye.material.f0 = {1, 1, 1};
      delivered.push_back(eye_radiance(baked, own, eye).specular);
    }
  }
  print("delivered", against(delivered, point, seen.size()));
}

/// Lightings that hardly reach the surface are dropped, as in the certificate.
Lightings that_reach(const Lightings& all, const std::vector<EyedPoint>& eyed, const Tracer& tracer, Threads& threads) {
  const ReferenceResult seen = trace_specular(
      tracer, eyed, {.sh_order = static_cast<int>(std::lround(std::sqrt(all.sh[0].size()))), .sh = all.sh},
      {.samples = 256, .seed = 3}, threads);
  std::vector<double> mean;
  for (std::size_t k = 0; k < all.sh.size(); ++k) {
    double sum = 0;
    for (std::size_t p = 0; p < eyed.size(); ++p) sum += std::abs(seen.value[k * eyed.size() + p].x);
    mean.push_back(sum / double{all.sh[k][0].x});
  }
  Lightings out;
  for (std::size_t k = 0; k < mean.size(); ++k) {
    if (mean[k] < 0.05 * std::ranges::max(mean)) continue;
    out.names.push_back(all.names[k]);
    out.sh.push_back(all.sh[k]);
  }
  return out;
}

Bytes bytes_of(const char* path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

int run(int argc, char** argv) {
  if (argc < 3) return std::fprintf(stderr, "kiln_glossy INPUT.glb BAKED/scene.glb [paths] [points]\n"), 2;
  const int paths = argc > 3 ? std::atoi(argv[3]) : 4096;
  const std::size_t count = argc > 4 ? std::strtoull(argv[4], nullptr, 10) : 512;
  Threads threads;
  const auto input = import_scene({argv[1], bytes_of(argv[1]), {}});
  const auto baked = read_baked_glb(bytes_of(argv[2]));
  if (!input || !baked || !baked->glossy) return std::fprintf(stderr, "no scene, or no matrices\n"), 1;
  const std::vector<Seen> seen = open_eyes(*baked, *input, count);
  std::vector<EyedPoint> eyed;
  for (const Seen& s : seen) eyed.push_back(s.truth);
  const Tracer tracer(*input, threads);
  const Lightings lightings = that_reach(test_lightings(baked->glossy.order, {}), eyed, tracer, threads);
  const ReferenceLight light{.sh_order = baked->glossy.order, .sh = lightings.sh};
  // Schlick's term of F0 = 1 is none: the lobe times 1.
  const ReferenceResult lobe = trace_specular(tracer, eyed, light, {.samples = paths, .seed = 1}, threads);
  ReferenceResult own;
  for (int order = 2; order <= 9; ++order) {
    std::vector<std::vector<double>> kernel;
    for (const EyedPoint& e : eyed) kernel.push_back(fitted_kernel(order, e));
    const ReferenceResult bands = trace_kernels(tracer, {eyed, kernel}, light, {.samples = paths, .seed = 2}, threads);
    std::vector<Vec3d> noise = noise_from_halves(bands.half_a, bands.half_b);
    const std::vector<Vec3d> more = noise_from_halves(lobe.half_a, lobe.half_b);
    for (std::size_t i = 0; i < noise.size(); ++i) noise[i] += more[i];
    print("bands " + std::to_string(order), compute_error({bands.value, lobe.value, noise, eyed.size()}, {.seed = 1}));
    if (order == baked->glossy.order) own = bands;
  }
  split_transport(*baked, lightings, seen, own, threads);
  return 0;
}

}  // namespace
}  // namespace kiln::bench

int main(int argc, char** argv) { return kiln::bench::run(argc, argv); }
