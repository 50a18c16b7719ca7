// Nanoseconds of one call of each harmonic routine, by order. One JSON line a case.
#include <array>
#include <cstdio>

#include "core/base/random.h"
#include "core/sphere/sampling.h"
#include "core/sphere/sh.h"
#include "core/sphere/sobol_points.h"
#include "tests/bench/bench.h"

namespace kiln::bench {
namespace {

constexpr int kCalls = 100000;

template <class Body>
void measure(const char* name, int order, const Body& body) {
  std::vector<double> seconds;
  for (int round = 0; round < 7; ++round) {
    const double start = thread_seconds();
    for (std::uint32_t i = 0; i < kCalls; ++i) body(i);
    seconds.push_back(thread_seconds() - start);
  }
  std::printf("{\"bench\":\"sphere_rates\",\"case\":\"%s\",\"order\":%d,\"ns\":%.1f}\n", name, order,
              median(seconds) / kCalls * 1e9);
}

void measure_order(int order) {
  std::array<float, sh_count(kMaxShOrder)> in{}, out{};
  Random random(1, 0);
  for (float& c : in) c = random.uniform();
  std::vector<Basis<float>> bases;
  for (int i = 0; i < 256; ++i)
    bases.push_back(basis_around(to_float(uniform_sphere({random.uniform_double(), random.uniform_double()}))));
  measure("rotate_sh", order, [&](std::uint32_t i) { rotate_sh(order, bases[i % 256], in.data(), out.data()); });
  measure("evaluate_sh", order, [&](std::uint32_t i) { evaluate_sh(order, bases[i % 256].z, out.data()); });
  measure("clamped_cosine_transfer", order,
          [&](std::uint32_t i) { clamped_cosine_transfer(order, bases[i % 256].z, out.data()); });
  if (out[0] == 12345) std::puts("never");
}

}  // namespace
}  // namespace kiln::bench

int main() {
  for (const int order : {3, 6, 10}) kiln::bench::measure_order(order);
  float sum = 0;
  kiln::bench::measure("sobol_owen", 0, [&](std::uint32_t i) { sum += kiln::sobol_owen(i, 7).x; });
  const kiln::SobolPoints points(7);
  kiln::bench::measure("SobolPoints, a point", 0, [&](std::uint32_t i) { sum += points[i & 0xfff].x; });
  kiln::bench::measure("SobolPoints, a seed", 0, [&](std::uint32_t i) { sum += kiln::SobolPoints(i)[0].x; });
  return sum < 0;
}
