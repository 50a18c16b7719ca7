#include "core/bake/field_views.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "core/bake/field_eye.h"
#include "core/base/random.h"
#include "core/trace/surface_samples.h"

namespace kiln {
namespace {

/// q of equation 1, but for a factor.
std::vector<double> wishes(std::span<const FieldView> all) {
  const auto n = static_cast<double>(all.size());
  double light = 0, change = 0;
  for (const FieldView& v : all) light += dot(v.shown, v.shown) / n, change += v.change * v.change / n;
  std::vector<double> out;
  for (const FieldView& v : all) {
    out.push_back(1 + (light > 0 ? dot(v.shown, v.shown) / light : 0) +
                  (change > 0 ? v.change * v.change / change : 0));
  }
  return out;
}

/// Chances of at most 1 with the sum `count`: those that reach 1 leave the others more.
std::vector<double> chances(std::vector<double> wish, double count) {
  std::vector<double> out(wish.size(), 0.0);
  double certain = 0;
  for (bool more = true; more;) {
    double sum = 0;
    for (std::size_t i = 0; i < wish.size(); ++i) sum += out[i] < 1 ? wish[i] : 0;
    more = false;
    const double factor = sum > 0 ? std::max(0.0, count - certain) / sum : 0;
    for (std::size_t i = 0; i < wish.size(); ++i) {
      if (out[i] >= 1) continue;
      out[i] = factor * wish[i];
      if (out[i] < 1) continue;
      out[i] = 1, certain += 1, more = true;
    }
  }
  return out;
}

}  // namespace

std::vector<FieldView> even_views(const BakedScene& decoded, const Mesh& input, std::size_t count, std::uint64_t seed,
                                  Threads& threads) {
  const Mesh& mesh = decoded.scene.mesh;
  const ClosestPoint nearest(input);
  const FieldEye eye(decoded);
  const std::vector<SurfaceSample> samples = sample_surface(mesh, count, seed);
  std::vector<std::optional<FieldView>> found(samples.size());
  threads.for_blocks(samples.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const SurfaceMatch here{samples[i].triangle, samples[i].u, samples[i].v, 0};
      const Vec3d normal = match_normal(mesh, here);
      const auto match = nearest.query(match_position(mesh, here), normal);
      if (!match) continue;
      Random random(seed, i);
      const Vec3d there = match_normal(input, *match), view = random_view(there, random);
      const Vec3d shown = eye.seen(here, normal, view);
      found[i] =
          FieldView{*match, there, view, shown, length(shown - eye.seen(here, normal, random_view(there, random)))};
    }
  });
  std::vector<FieldView> out;
  for (const auto& view : found)
    if (view) out.push_back(*view);
  return out;
}

std::vector<FieldView> choose_views(std::span<const FieldView> all, std::size_t count, std::uint64_t seed) {
  if (count >= all.size()) return {all.begin(), all.end()};
  const std::vector<double> chance = chances(wishes(all), static_cast<double>(count));
  double next = Random(seed, 0x63686f6f7365ULL).uniform_double(), sum = 0;
  std::vector<FieldView> out;
  for (std::size_t i = 0; i < all.size(); ++i) {
    sum += chance[i];
    if (sum <= next) continue;
    out.push_back(all[i]);
    out.back().weight = 1 / chance[i];
    next += 1;
  }
  return out;
}

}  // namespace kiln
