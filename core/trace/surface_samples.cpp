#include "core/trace/surface_samples.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/mesh/topology.h"
#include "core/sphere/sampling.h"

namespace kiln {

std::vector<SurfaceSample> sample_surface(const Mesh& mesh, std::size_t count, std::uint64_t seed,
                                          std::span<const double> density) {
  std::vector<double> sum;
  sum.reserve(mesh.triangles.size());
  double total = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    sum.push_back(total += triangle_area(mesh, mesh.triangles[t]) * (density.empty() ? 1.0 : density[t]));
  std::vector<SurfaceSample> samples;
  if (!(total > 0)) return samples;
  samples.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    Random random(seed, i);
    const double place = (static_cast<double>(i) + random.uniform_double()) / static_cast<double>(count) * total;
    const auto found = std::upper_bound(sum.begin(), sum.end(), place);
    const auto triangle = std::min<std::size_t>(static_cast<std::size_t>(found - sum.begin()), sum.size() - 1);
    const Vec2<double> uv = uniform_triangle({random.uniform_double(), random.uniform_double()});
    samples.push_back({static_cast<std::uint32_t>(triangle), static_cast<float>(uv.x), static_cast<float>(uv.y)});
  }
  return samples;
}

Vec3d random_view(const Vec3d& n, Random& random) {
  const double z = 1 - random.uniform_double(), phi = 2 * std::numbers::pi * random.uniform_double();
  const double r = std::sqrt(1 - z * z);
  return normalized(basis_around(n).to_world({r * std::cos(phi), r * std::sin(phi), z}));
}

}  // namespace kiln
