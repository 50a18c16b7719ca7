// Surface light fields: what the algebra, the metric and simplification cost, and how far off results are.
//   kiln_light_field distance        closed form against product Gauss quadrature
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>

#include "core/base/random.h"
#include "core/lightfield/hemisphere_norm.h"
#include "core/sphere/quadrature.h"
#include "core/sphere/sampling.h"
#include "tests/bench/bench.h"

namespace kiln::bench {
namespace {

constexpr std::size_t kRing = 6;  // neighbours of a vertex, on average

/// Nanoseconds of one call of `body`, the least of several rounds.
template <class Body>
double nanoseconds(int calls, const Body& body) {
  double least = HUGE_VAL;
  for (int round = 0; round < 7; ++round) {
    const double start = thread_seconds();
    for (int i = 0; i < calls; ++i) body(i);
    least = std::min(least, thread_seconds() - start);
  }
  return 1e9 * least / calls;
}

/// The best that quadrature can do: functions upright already, harmonics at the nodes at hand.
class TabulatedQuadrature {
 public:
  explicit TabulatedQuadrature(int degree) : count_(static_cast<std::size_t>(sh_count(degree + 1))) {
    const int steps = 2 * degree + 1;
    for (const QuadratureNode& node : gauss_legendre(degree + 1)) {
      const double z = 0.5 * (node.x + 1), radius = std::sqrt(1 - z * z);
      for (int k = 0; k < steps; ++k) {
        const double phi = 2 * std::numbers::pi * k / steps;
        values_.resize(values_.size() + count_);
        evaluate_sh(degree + 1, Vec3d{radius * std::cos(phi), radius * std::sin(phi), z},
                    values_.data() + values_.size() - count_);
        weights_.push_back(0.5 * node.weight / steps);
      }
    }
  }
  double squared_norm(const double* rgb) const {  // coefficient i of channel c is rgb[4 i + c]
    double sum = 0;
    const double* y = values_.data();
    for (const double weight : weights_) {
      double value[4] = {};
      for (std::size_t i = 0; i < count_; ++i)
        for (std::size_t c = 0; c < 4; ++c) value[c] += y[i] * rgb[4 * i + c];
      sum += weight * (value[0] * value[0] + value[1] * value[1] + value[2] * value[2]);
      y += count_;
    }
    return sum;
  }

 private:
  std::size_t count_;
  std::vector<double> values_, weights_;
};

void measure_distance(int degree) {
  const HemisphereNorm norm(degree);
  const TabulatedQuadrature tabulated(degree);
  const std::size_t count = norm.count();
  Random random(1, 0);
  std::vector<double> rgb(4 * count), ring(count * 3 * kRing), work;
  for (double& x : rgb) x = random.uniform_double() - 0.5;
  for (double& x : ring) x = random.uniform_double() - 0.5;
  std::array<Vec3d, 64> normals;
  for (Vec3d& n : normals) n = uniform_sphere({random.uniform_double(), random.uniform_double()});
  volatile double sink = 0;
  const auto normal = [&](int i) { return normals[static_cast<std::size_t>(i) % 64]; };
  const double quadrature = nanoseconds(100, [&](int i) {
    sink = squared_norm_by_quadrature(degree, normal(i), {rgb.data(), 3 * count});
  });
  const double table = nanoseconds(1000, [&](int) { sink = tabulated.squared_norm(rgb.data()); });
  const double single = nanoseconds(1000, [&](int i) {
    sink = squared_norm(norm, normal(i), {rgb.data(), 3 * count});
  });
  // All that a removed vertex needs for its half-edge candidates: the ring upright, and the products of all pairs.
  const double per_vertex = nanoseconds(1000, [&](int i) {
    work = ring;
    norm.to_coordinates(normal(i), 3 * kRing, work.data());
    double gram[kRing][kRing] = {};
    for (std::size_t k = 0; k < count; ++k) {
      const double* row = work.data() + k * 3 * kRing;
      for (std::size_t a = 0; a < kRing; ++a)
        for (std::size_t b = 0; b <= a; ++b)
          for (std::size_t c = 0; c < 3; ++c) gram[a][b] += row[3 * a + c] * row[3 * b + c];
    }
    sink = gram[kRing - 1][0];
  });
  const double all_in = per_vertex / (kRing * (kRing - 2));  // each candidate leaves ring - 2 triangles
  std::printf(R"({"bench":"distance","degree":%d,"quadrature_ns":%.0f,"tabulated_quadrature_ns":%.0f,"closed_ns":%.0f,)"
              R"("vertex_ns":%.0f,"all_in_ns":%.0f,"ratio":%.1f,"ratio_to_tabulated":%.1f})"
              "\n",
              degree, quadrature, table, single, per_vertex, all_in, quadrature / all_in, table / all_in);
}

int main_of(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  if (what == "distance") {
    for (const int degree : {0, 2, 4, 6, 8}) measure_distance(degree);
    return 0;
  }
  return std::fprintf(stderr, "kiln_light_field distance\n"), 2;
}

}  // namespace
}  // namespace kiln::bench

int main(int argc, char** argv) { return kiln::bench::main_of(argc, argv); }
