// Krivanek's figure 1 in numbers: error of linear interpolation on adaptive and uniform meshes at equal budgets.
// Error is relRMSE over a constant sky and six lobes along the axes, each scaled to a mean of 1, at random points of
// the surface, against transfer computed there (many more samples; its noise is estimated from two halves and
// subtracted). One JSON line for each mesh.
//   kiln_subdivision [samples] [points] [scene]

#include <cmath>
#include <cstdlib>
#include <functional>
#include <string>
#include <utility>

#include "core/base/random.h"
#include "core/mesh/topology.h"
#include "core/prt/direct_transfer.h"
#include "core/prt/subdivide.h"
#include "core/sphere/sh.h"
#include "tests/bench/bench.h"
#include "tests/core/prt/test_scenes.h"

namespace kiln::bench {
namespace {

constexpr int kOrder = 6;
constexpr std::size_t kWidth = sh_count(kOrder);

// A constant sky, and max(0, w . axis) for the six axes: a clamped cosine is pi times its own transfer vector.
std::vector<std::vector<float>> lightings() {
  std::vector<std::vector<float>> all(7, std::vector<float>(kWidth, 0.0F));
  all[0][0] = 3.5449077F;
  const Vec3f axes[] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  for (std::size_t i = 0; i < 6; ++i) clamped_cosine_transfer(kOrder, axes[i], all[i + 1].data());
  return all;
}

double shade(const float* transfer, const std::vector<float>& light) {
  double sum = 0;
  for (std::size_t i = 0; i < kWidth; ++i) sum += double{transfer[i]} * light[i];
  return sum;
}

struct Truth {
  std::vector<TransferPoint> points;
  std::vector<float> half_a, half_b;
};

// Uniform over the input surface; flat-shaded faces but for smooth parts, whose normals are interpolated.
Truth make_truth(const Scene& scene, const Tracer& tracer, std::size_t count, Threads& threads) {
  const Mesh& mesh = scene.mesh;
  std::vector<double> cumulative;
  double sum = 0;
  for (const Triangle& t : mesh.triangles) cumulative.push_back(sum += triangle_area(mesh, t));
  Truth truth;
  for (std::size_t i = 0; i < count; ++i) {
    Random random(77, i);
    const double at = (static_cast<double>(i) + random.uniform_double()) / static_cast<double>(count) * sum;
    const auto index = std::upper_bound(cumulative.begin(), cumulative.end() - 1, at) - cumulative.begin();
    const Triangle& t = mesh.triangles[static_cast<std::size_t>(index)];
    const float r = std::sqrt(random.uniform()), v = random.uniform();
    const float a = 1 - r, b = r * (1 - v), c = r * v;
    const auto blend = [&](const std::vector<Vec3f>& x) { return x[t[0]] * a + x[t[1]] * b + x[t[2]] * c; };
    const Vec3f position = blend(mesh.position);
    truth.points.push_back({.position = position,
                            .normal = normalized(blend(mesh.normal)),
                            .inward = position,
                            .face_normal = normalized(area_vector(mesh, t))});
  }
  truth.half_a = bake_direct_transfer(tracer, truth.points, {.order = kOrder, .samples = 8192, .seed = 11}, threads);
  truth.half_b = bake_direct_transfer(tracer, truth.points, {.order = kOrder, .samples = 8192, .seed = 12}, threads);
  return truth;
}

// Values of a mesh at a point: the triangle of the same plane that holds it.
std::vector<float> interpolate(const Mesh& mesh, const std::vector<float>& values, const Truth& truth) {
  // The mesh refines the input, and a point lies on one input triangle: a ray from just above, straight down.
  Scene scene = testing::empty_scene();
  scene.mesh = mesh;
  Threads one(1);
  const Tracer tracer(scene, one);
  std::vector<float> out(truth.points.size() * kWidth, 0.0F);
  for (std::size_t i = 0; i < truth.points.size(); ++i) {
    const TransferPoint& p = truth.points[i];
    const Hit hit = tracer.closest(p.position + p.face_normal * 4e-6F, -p.face_normal, 1e-4F);
    if (!hit) continue;
    const Triangle& t = mesh.triangles[hit.triangle];
    for (std::size_t k = 0; k < kWidth; ++k) {
      out[i * kWidth + k] = (1 - hit.u - hit.v) * values[t[0] * kWidth + k] + hit.u * values[t[1] * kWidth + k] +
                            hit.v * values[t[2] * kWidth + k];
    }
  }
  return out;
}

struct Error {
  double all = 0, without_worst = 0;  // relRMSE; without the worst 1 % of points
};

Error relative_error(const Truth& truth, const std::vector<float>& x) {
  const std::size_t count = truth.points.size();
  std::vector<double> square(count, 0.0);  // of each point, mean over lightings scaled to a mean of 1
  double open = 0;
  int lit = 0;
  for (const std::vector<float>& light : lightings()) {
    double mean = 0;
    std::vector<double> of_light;
    for (std::size_t i = 0; i < count; ++i) {
      const double a = shade(&truth.half_a[i * kWidth], light), b = shade(&truth.half_b[i * kWidth], light);
      const double difference = shade(&x[i * kWidth], light) - 0.5 * (a + b);
      mean += 0.5 * (a + b) / static_cast<double>(count);
      of_light.push_back(difference * difference - 0.25 * (a - b) * (a - b));  // less the reference's own noise
    }
    // What lights nothing (a lobe from below a floor: all that is left is the ringing of six bands) has no error.
    open = std::max(open, mean);
    if (mean < 0.01 * open) continue;
    for (std::size_t i = 0; i < count; ++i) square[i] += of_light[i] / (mean * mean);
    ++lit;
  }
  std::sort(square.begin(), square.end());
  const auto root_mean = [&](std::size_t points) {
    double sum = 0;
    for (std::size_t i = 0; i < points; ++i) sum += square[i];
    return std::sqrt(std::max(0.0, sum / static_cast<double>(points) / std::max(1, lit)));
  };
  return {root_mean(count), root_mean(count - count / 100)};
}

struct Bench {
  const char* name;
  Scene scene;
  std::vector<std::uint64_t> uniform;  // budgets
  std::uint64_t adaptive;
  int samples = 4096;
  Truth truth;
};

void report(const Bench& bench, const char* measure, std::uint64_t budget, const Subdivided& result, double seconds) {
  const Error error = relative_error(bench.truth, interpolate(result.mesh, result.values, bench.truth));
  std::printf(
      "{\"bench\":\"subdivision\",\"scene\":\"%s\",\"input\":%zu,\"measure\":\"%s\",\"budget\":%llu,"
      "\"triangles\":%zu,\"vertices\":%zu,\"evaluated\":%llu,\"samples\":%d,\"relrmse\":%.5f,\"without_worst_1pct\":%."
      "5f,\"cpu_seconds\":%.2f}\n",
      bench.name, bench.scene.mesh.triangles.size(), measure, static_cast<unsigned long long>(budget),
      result.mesh.triangles.size(), result.mesh.position.size(), static_cast<unsigned long long>(result.evaluated),
      bench.samples, error.all, error.without_worst, seconds);
  std::fflush(stdout);
}

void run(Bench& bench, std::size_t points, Threads& threads) {
  const Tracer tracer(bench.scene, threads);
  bench.truth = make_truth(bench.scene, tracer, points, threads);
  const DirectTransferBaker baker(tracer, {.order = kOrder, .samples = bench.samples, .seed = 1});
  const ValueSource source{kWidth, [&](std::span<const TransferPoint> p) { return baker.bake(p, threads); }, {0}};
  for (const std::uint64_t budget : bench.uniform) {
    // eq. 3 on positions is the perimeter: the largest triangle is split first. Transfer comes afterwards.
    const ValueSource positions{3, [](std::span<const TransferPoint> points) {
                                  std::vector<float> values;
                                  for (const TransferPoint& p : points)
                                    values.insert(values.end(), {p.position.x, p.position.y, p.position.z});
                                  return values;
                                }};
    const double start = process_seconds();
    Subdivided result =
        subdivide(bench.scene.mesh, positions, {.measure = SplitMeasure::eq3, .triangles = budget}, threads);
    result.values = source.values(vertex_points(result.mesh));
    report(bench, "uniform", budget, result, process_seconds() - start);
  }
  const std::pair<const char*, SplitMeasure> measures[] = {{"eq2", SplitMeasure::eq2},
                                                           {"eq3", SplitMeasure::eq3},
                                                           {"eq4", SplitMeasure::eq4},
                                                           {"residual", SplitMeasure::residual}};
  for (const auto& [name, measure] : measures) {
    const double start = process_seconds();
    const Subdivided result =
        subdivide(bench.scene.mesh, source, {.measure = measure, .triangles = bench.adaptive}, threads);
    report(bench, name, bench.adaptive, result, process_seconds() - start);
  }
  const double start = process_seconds();
  ValueSource as_baked = source;
  as_baked.hidden = hidden_test(tracer);
  report(bench, "residual, cut", bench.adaptive,
         subdivide(bench.scene.mesh, as_baked, {.triangles = bench.adaptive}, threads), process_seconds() - start);
}

}  // namespace
}  // namespace kiln::bench

int main(int argc, char** argv) {
  using namespace kiln;
  const int samples = argc > 1 ? std::atoi(argv[1]) : 4096;
  const std::size_t points = argc > 2 ? std::strtoul(argv[2], nullptr, 10) : 4000;
  Threads threads(2);
  bench::Bench scenes[] = {{"column", testing::column_scene(), {246, 2584, 2828}, 2828, samples, {}},
                           {"room", testing::room_scene(), {180, 2828}, 2828, samples, {}},
                           {"knot", testing::knot_scene(), {1736, 6944}, 6944, samples, {}}};
  const std::string only = argc > 3 ? argv[3] : "";
  for (bench::Bench& b : scenes) {
    if (only.empty() || only == b.name) bench::run(b, points, threads);
  }
}
