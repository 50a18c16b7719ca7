// How many rays does direct transfer take for the same error: points that stop by themselves
// (core/prt/direct_transfer.h) against the same number of rays for each point?
//   kiln_sampling MODEL.glb OUT/scene.glb        OUT is what `kiln bake MODEL.glb` delivered: its vertices are the
//   points
// Fixed numbers of rays are of three kinds: `random` cosine-distributed ones, `jittered` ones (one in each cell of a
// square grid, the textbook's), and `sobol`, ours without stopping. A JSON line for each tolerance: rays a point,
// relRMSE (band by band in proportion to the power of light, as certificates count), and how many rays of each kind
// reach it, as a multiple; for sobol, which runs in the same code, processor time as well.

#include "core/sphere/sampling.h"

#include <cmath>
#include <cstdio>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client_cli/models.h"
#include "core/bake/lightings.h"
#include "core/base/random.h"
#include "core/prt/direct_transfer.h"
#include "core/prt/ray_origin.h"
#include "core/sphere/sh.h"
#include "tests/bench/bench.h"

namespace kiln {
namespace {

using nlohmann::json;
using Values = std::vector<float>;

constexpr int kOrder = 6;
constexpr std::size_t kPoints = 4000;
constexpr int kCap = 1024;  // rays at which a point stops anyway, as at standard quality

struct Run {
  double rays = 0, seconds = 0, error = 0;  // rays and seconds of a point
};

class Bench {
 public:
  Bench(const Scene& scene, const Mesh& delivered, Threads& threads)
      : threads_(threads), tracer_(scene, threads), power_(band_power(kOrder, {})) {
    const std::vector<TransferPoint> all = vertex_points(delivered);
    for (std::size_t i = 0; i < all.size(); i += 1 + all.size() / kPoints) points_.push_back(all[i]);
    truth_ = bake_direct_transfer(tracer_, points_, {.order = kOrder, .samples = 32768, .seed = 77}, threads_);
    for (std::size_t i = 0; i < truth_.size(); i += kBands) mean_ += 2 * std::sqrt(M_PI) * truth_[i];
    mean_ /= static_cast<double>(points_.size());
  }

  Run ours(int samples, double noise) {
    DirectTransfer params{.order = kOrder, .samples = samples};
    if (noise > 0) {
      params.tolerance = static_cast<float>(noise * mean_);
      params.band_power.assign(power_.begin(), power_.end());
    }
    const DirectTransferBaker baker(tracer_, params);
    TransferStats stats;
    Values values;
    std::vector<double> seconds;
    for (int i = 0; i < 3; ++i) {
      stats = {};
      const double start = bench::process_seconds();
      values = baker.bake(points_, threads_, &stats);
      seconds.push_back(bench::process_seconds() - start);
    }
    const auto n = static_cast<double>(points_.size());
    return {static_cast<double>(stats.rays) / n, bench::median(seconds) / n, error_of(values)};
  }

  /// Cosine-distributed rays from `square(ray)`, places in the unit square.
  Run plain(int samples, bool jittered) {
    Values values(truth_.size(), 0.0F);
    const int side = static_cast<int>(std::lround(std::sqrt(samples)));
    threads_.for_blocks(points_.size(), 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t p = begin; p < end; ++p) add_plain(p, side, jittered, values.data() + p * kBands);
    });
    return {static_cast<double>(side * side), 0, error_of(values)};
  }

 private:
  static constexpr std::size_t kBands = kOrder * kOrder;

  void add_plain(std::size_t p, int side, bool jittered, float* out) const {
    const TransferPoint& point = points_[p];
    const auto basis = basis_around(to_double(point.normal));
    const Vec3f origin = ray_origin(point);
    Random random(5, p);
    std::array<double, kBands> y{};
    for (int i = 0; i < side * side; ++i) {
      Vec2<double> u{random.uniform_double(), random.uniform_double()};
      if (jittered) u = {(i % side + u.x) / side, (i / side + u.y) / side};
      const Vec3d w = basis.to_world(cosine_hemisphere(u));
      if (tracer_.occluded(origin, to_float(w), kFar)) continue;
      evaluate_sh(kOrder, w, y.data());
      for (std::size_t b = 0; b < kBands; ++b) out[b] += static_cast<float>(y[b] / (side * side));
    }
  }

  double error_of(const Values& values) const {
    double sum = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const auto band = static_cast<std::size_t>(std::sqrt(static_cast<double>(i % kBands) + 0.5));
      sum += power_[band] * std::pow(values[i] - truth_[i], 2);
    }
    return std::sqrt(sum / static_cast<double>(points_.size())) / mean_;
  }

  Threads& threads_;
  Tracer tracer_;
  std::vector<double> power_;
  std::vector<TransferPoint> points_;
  Values truth_;
  double mean_ = 0;
};

/// What the fixed numbers would need for this error: a straight line through the logarithms of its two neighbours.
double needed(const std::vector<Run>& fixed, double error, double Run::*what) {
  std::size_t i = 1;
  while (i + 1 < fixed.size() && fixed[i].error > error) ++i;
  const Run &a = fixed[i - 1], &b = fixed[i];
  const double share = std::log(a.error / error) / std::log(a.error / b.error);
  return a.*what * std::pow(b.*what / a.*what, share);
}

int run(int count, char** words) {
  if (count != 3) {
    std::fprintf(stderr, "Usage: kiln_sampling MODEL.glb OUT/scene.glb\n");
    return 2;
  }
  const auto scene = load_scene(words[1]);
  const auto artefact = load_artefact(words[2]);
  if (!scene || !artefact) {
    std::fprintf(stderr, "%s\n", (scene ? artefact.error() : scene.error()).problem.detail.c_str());
    return 1;
  }
  Threads threads;
  Bench bench(*scene, artefact->scene.mesh, threads);
  std::vector<Run> random, jittered, sobol;
  for (const int samples : {64, 256, 1024, 4096}) {
    random.push_back(bench.plain(samples, false));
    jittered.push_back(bench.plain(samples, true));
    sobol.push_back(bench.ours(samples, 0));
  }
  for (const double noise : {0.04, 0.02, 0.01, 0.005}) {
    const Run stops = bench.ours(kCap, noise);
    std::printf("%s\n", json{{"noise", noise},
                             {"error", stops.error},
                             {"rays", stops.rays},
                             {"random", needed(random, stops.error, &Run::rays) / stops.rays},
                             {"jittered", needed(jittered, stops.error, &Run::rays) / stops.rays},
                             {"sobol", needed(sobol, stops.error, &Run::rays) / stops.rays},
                             {"sobol_time", needed(sobol, stops.error, &Run::seconds) / stops.seconds}}
                            .dump()
                            .c_str());
  }
  return 0;
}

}  // namespace
}  // namespace kiln

int main(int count, char** words) { return kiln::run(count, words); }
