#include "core/bake/field_views.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>

#include "core/bake/eye_material.h"
#include "core/bake/field_eye.h"
#include "core/base/random.h"
#include "core/lightfield/outgoing.h"
#include "core/trace/environment_sampler.h"
#include "core/trace/surface_samples.h"

namespace kiln {
namespace {

/// q of equation 1, but for a factor.
std::vector<double> wishes(std::span<const FieldView> all) {
  const auto squares = [](const FieldView& v) {
    return std::array{dot(v.shown, v.shown), v.change * v.change, v.mirror * v.mirror};
  };
  std::array<double, 3> mean{};
  double views = 0;
  for (const FieldView& v : all) {
    for (std::size_t k = 0; k < mean.size(); ++k) mean[k] += v.weight * squares(v)[k];
    views += v.weight;
  }
  std::vector<double> out;
  for (const FieldView& v : all) {
    double wish = 1;
    for (std::size_t k = 0; k < mean.size(); ++k) wish += mean[k] > 0 ? squares(v)[k] * views / mean[k] : 0;
    out.push_back(v.weight * wish);
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

/// Draws eyes by equation 2, and says what a mirror shows them of the sky.
class Mirrors {
 public:
  Mirrors(const Scene& input, const Environment* sky) : input_(input), sky_(sky) {
    if (sky != nullptr) sampler_.emplace(*sky);
  }

  /// Null where the mirror would show what is behind the surface. Of every other one `in_mirror`.
  std::optional<Vec3d> draw(const Vec3d& n, bool in_mirror, Random& random) const {
    if (!in_mirror || !useful()) return random_view(n, random);
    const double first = random.uniform_double();
    const Vec3d l = sampler_->sample({first, random.uniform_double()});
    return dot(n, l) > 0 ? std::optional(reflected(n, l)) : std::nullopt;
  }

  double weight(const Vec3d& n, const Vec3d& view) const {
    constexpr double kEven = 0.5 / std::numbers::pi;
    return useful() ? kEven / (0.5 * kEven + 0.5 * sampler_->density(reflected(n, view))) : 1;
  }

  /// d of equation 1.
  double mirrored(const FieldView& at) const {
    if (!useful()) return 0;
    const SurfacePoint point =
        surface_point(input_, at.truth.triangle, static_cast<float>(at.truth.u), static_cast<float>(at.truth.v));
    const EyeMaterial material = eye_material(input_, point);
    const Vec3d light = to_double(environment_radiance(*sky_, to_float(reflected(at.normal, at.view))));
    return share_apart(material.roughness) * length(material.f0 * light);
  }

 private:
  bool useful() const { return sampler_ && sampler_->useful(); }
  static Vec3d reflected(const Vec3d& n, const Vec3d& w) { return n * (2 * dot(n, w)) - w; }

  const Scene& input_;
  const Environment* sky_;
  std::optional<EnvironmentSampler> sampler_;
};

}  // namespace

std::vector<FieldView> many_views(const BakedScene& decoded, const Scene& input, const Environment* sky,
                                  const ManyViews& params, Threads& threads) {
  const Mesh& mesh = decoded.scene.mesh;
  const ClosestPoint nearest(input.mesh);
  const FieldEye eye(decoded);
  const Mirrors mirrors(input, sky);
  const std::vector<SurfaceSample> samples = sample_surface(mesh, params.count, params.seed);
  std::vector<std::optional<FieldView>> found(samples.size());
  threads.for_blocks(samples.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const SurfaceMatch here{samples[i].triangle, samples[i].u, samples[i].v, 0};
      const Vec3d normal = match_normal(mesh, here);
      const auto match = nearest.query(match_position(mesh, here), normal);
      if (!match) continue;
      Random random(params.seed, i);
      const Vec3d there = match_normal(input.mesh, *match);
      const std::optional<Vec3d> view = mirrors.draw(there, i % 2 == 1, random);
      if (!view) continue;
      FieldView one{.truth = *match, .normal = there, .view = *view, .shown = eye.seen(here, normal, *view)};
      one.change = length(one.shown - eye.seen(here, normal, random_view(there, random)));
      one.mirror = mirrors.mirrored(one);
      one.weight = mirrors.weight(there, *view);
      found[i] = one;
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
    out.back().weight = all[i].weight / chance[i];
    next += 1;
  }
  return out;
}

}  // namespace kiln
