#include "core/trace/reference.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/base/expects.h"
#include "core/base/random.h"
#include "core/base/shared_loop.h"
#include "core/sphere/sampling.h"
#include "core/sphere/sh.h"
#include "core/trace/environment_sampler.h"
#include "core/trace/ggx.h"
#include "core/trace/lamp_light.h"
#include "core/trace/surface.h"

namespace kiln {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();
constexpr int kSafeBounces = 2;  // Russian roulette spares the first vertices

Vec3d times(const Vec3d& a, const Vec3f& b) { return a * to_double(b); }
double largest(const Vec3d& a) { return std::max({a.x, a.y, a.z}); }

/// The numbers of one path: stratified over the samples of a point at its first vertex, independent after it.
class PathNumbers {
 public:
  PathNumbers(std::uint64_t seed, std::uint64_t point, std::uint64_t sample)
      : random_(seed, point, sample),
        index_(static_cast<std::uint32_t>(sample / 2)),
        scrambling_(mix64(mix64(seed ^ 0x5eedULL) ^ (2 * point + sample % 2))) {}

  double number() { return random_.uniform_double(); }
  Vec2<double> pair(int depth) {
    if (depth > 0) return {number(), number()};
    const Vec2f u = sobol_owen(index_, scrambling_++);
    return {u.x, u.y};
  }

 private:
  Random random_;
  std::uint32_t index_;
  std::uint64_t scrambling_;  // another one for each pair
};

class Estimator {
 public:
  Estimator(const Tracer& tracer, const ReferenceLight& light, const ReferenceOptions& options)
      : tracer_(tracer),
        scene_(tracer.scene()),
        light_(light),
        options_(options),
        lamps_(tracer, light.lamps, light.scene_lights) {
    for (const Environment& e : light.environments) samplers_.emplace_back(e);
  }

  std::size_t distant() const { return light_.environments.size() + light_.sh.size(); }
  std::size_t lightings() const { return distant() + lamps_.lightings(); }

  /// Adds one path from `start` to sum[lighting]. Returns its vertices.
  int add_path(const PathVertex& start, PathNumbers& numbers, std::vector<Vec3d>& sum) const;

  /// The same, weighed by a lobe at `point` first. A lobe draws directions in the frame of the normal, tells their
  /// density, and what light from one of them counts, cosine and all.
  template <class Lobe>
  int add_lobe_path(const ReferencePoint& point, const Lobe& lobe, PathNumbers& numbers, std::vector<Vec3d>& sum) const;

  std::uint64_t rays_per_vertex() const {
    std::uint64_t rays = 1 + lamps_.rays_per_vertex();
    for (const EnvironmentSampler& sampler : samplers_) rays += sampler.useful() ? 1 : 0;
    return rays;
  }

 private:
  template <class Lobe>
  void add_lobe_sky(const PathVertex&, const Lobe&, PathNumbers&, std::vector<Vec3d>& sum) const;
  void add_sky_samples(const PathVertex&, const Vec3d& weight, int depth, PathNumbers&, std::vector<Vec3d>& sum) const;
  void add_lamps(const PathVertex&, const Vec3d& weight, int depth, PathNumbers&, std::vector<Vec3d>& sum) const;
  std::span<Vec3d> lamps_of(std::vector<Vec3d>& sum) const { return std::span(sum).subspan(distant()); }
  void add_sky(const Vec3d& w, double density, const Vec3d& weight, std::vector<Vec3d>& sum) const;

  const Tracer& tracer_;
  const Scene& scene_;
  const ReferenceLight& light_;
  const ReferenceOptions& options_;
  LampLight lamps_;
  std::vector<EnvironmentSampler> samplers_;
};

/// A ray of the path left the scene along w, which it did with `density`.
void Estimator::add_sky(const Vec3d& w, double density, const Vec3d& weight, std::vector<Vec3d>& sum) const {
  std::size_t k = 0;
  for (; k < light_.environments.size(); ++k) {
    const double balance = density / (density + samplers_[k].density(w));
    sum[k] += times(weight, environment_radiance(light_.environments[k], to_float(w))) * balance;
  }
  if (light_.sh.empty()) return;
  std::array<double, sh_count(kMaxShOrder)> y;
  evaluate_sh(light_.sh_order, w, y.data());
  for (const std::vector<Vec3f>& coefficients : light_.sh) {
    Vec3d radiance;
    for (std::size_t i = 0; i < coefficients.size(); ++i) radiance += to_double(coefficients[i]) * y[i];
    sum[k++] += weight * radiance;
  }
}

/// One ray to the bright part of each map, where there is one.
void Estimator::add_sky_samples(const PathVertex& v, const Vec3d& weight, int depth, PathNumbers& numbers,
                                std::vector<Vec3d>& sum) const {
  for (std::size_t k = 0; k < samplers_.size(); ++k) {
    if (!samplers_[k].useful()) continue;
    const Vec3d w = samplers_[k].sample(numbers.pair(depth));
    const double own = std::max(0.0, dot(w, v.normal)) / std::numbers::pi;
    if (own <= 0 || tracer_.occluded(lifted(v), to_float(w), kFar)) continue;
    const double balanced = own / (own + samplers_[k].density(w));
    sum[k] += times(weight, environment_radiance(light_.environments[k], to_float(w))) * balanced;
  }
}

void Estimator::add_lamps(const PathVertex& v, const Vec3d& weight, int depth, PathNumbers& numbers,
                          std::vector<Vec3d>& sum) const {
  LampLight::Draw draw;
  if (depth >= options_.from) {
    if (lamps_.has_emitters()) draw.emitter = numbers.number(), draw.place = numbers.pair(depth);
    lamps_.add_direct(v, weight, draw, lamps_of(sum));
  }
  const auto counts = [&](int reflections) {
    return reflections >= options_.from && (options_.bounces < 0 || reflections <= options_.bounces);
  };
  const bool once = counts(depth + 1), twice = counts(depth + 2);
  if (lamps_.has_beams() && (once || twice)) {
    draw = {.pick = numbers.number(), .emitter = numbers.number(), .place = {}, .direction = {}, .reflection = {}};
    draw.place = numbers.pair(depth), draw.direction = numbers.pair(depth), draw.reflection = numbers.pair(depth);
    lamps_.add_beam(v, weight, draw, once, twice, lamps_of(sum));
  }
}

int Estimator::add_path(const PathVertex& start, PathNumbers& numbers, std::vector<Vec3d>& sum) const {
  PathVertex v = start;
  Vec3d weight{1, 1, 1};
  int depth = 0;
  for (;; ++depth) {
    const bool counts = depth >= options_.from;
    const Vec3d local = cosine_hemisphere(numbers.pair(depth));
    if (counts) add_sky_samples(v, weight, depth, numbers, sum);
    add_lamps(v, weight, depth, numbers, sum);

    const Vec3d w = normalized(basis_around(v.normal).to_world(local));
    const double density = std::max(local.z, 1e-30) / std::numbers::pi;
    const Hit hit = tracer_.closest(lifted(v), to_float(w), kFar);
    if (!hit) {
      if (counts) add_sky(w, density, weight, sum);
      break;
    }

    const SurfacePoint p = surface_point(scene_, hit.triangle, hit.u, hit.v);
    const Part& part = scene_.parts[scene_.mesh.part[hit.triangle]];
    if (hit.back && !scene_.materials[static_cast<std::size_t>(part.material)].double_sided) break;
    const double side = hit.back ? -1 : 1;
    const Vec3d face = to_double(p.geometric_normal) * side;
    if (counts) lamps_.add_met(v, w, density, hit, p, weight, lamps_of(sum));

    if (depth == options_.bounces) break;
    weight = times(weight, albedo_at(scene_, p));
    const double alive = std::min(1.0, largest(weight));
    if (options_.bounces < 0 && depth >= kSafeBounces) {
      if (numbers.number() >= alive) break;
      weight = weight / alive;
    }
    if (alive <= 0) break;
    v = vertex_after(v, to_double(p.position), to_double(p.normal) * side, face);
  }
  return depth + 1;
}

/// The GGX lobe of a surface towards an eye.
class GgxLobe {
 public:
  explicit GgxLobe(const EyedPoint& point)
      : alpha_(point.alpha),
        f0_(point.f0),
        view_(basis_around(normalized(to_double(point.at.normal))).to_local(normalized(to_double(point.view)))) {}

  bool seen() const { return view_.z > 0; }
  /// May lie below the surface, where the density is 0.
  Vec3d draw(const Vec2<double>& u) const { return sample_ggx(alpha_, view_, u).l; }
  double density(const Vec3d& l) const { return ggx_density(alpha_, view_, l); }
  Vec3d value(const Vec3d& l) const {
    return (f0_ + (Vec3d{1, 1, 1} - f0_) * schlick_weight(view_, l)) * ggx_cosine(alpha_, view_, l);
  }

 private:
  double alpha_;
  Vec3d f0_, view_;
};

/// A kernel of few bands: half of its directions are those of a GGX lobe, half even over the half space.
class KernelLobe {
 public:
  KernelLobe(const EyedPoint& point, const std::vector<double>& kernel)
      : like_(point), basis_(basis_around(normalized(to_double(point.at.normal)))), kernel_(kernel) {
    while (sh_count(order_) < static_cast<int>(kernel.size())) ++order_;
  }

  bool seen() const { return like_.seen(); }
  Vec3d draw(const Vec2<double>& u) const {
    if (u.x < 0.5) return like_.draw({2 * u.x, u.y});
    const double z = 2 * u.x - 1, r = std::sqrt(std::max(0.0, 1 - z * z)), phi = 2 * std::numbers::pi * u.y;
    return {r * std::cos(phi), r * std::sin(phi), z};
  }
  double density(const Vec3d& l) const { return l.z > 0 ? 0.5 * like_.density(l) + 0.25 / std::numbers::pi : 0; }
  Vec3d value(const Vec3d& l) const {
    if (!(l.z > 0)) return {};
    std::array<double, sh_count(kMaxShOrder)> y;
    evaluate_sh(order_, normalized(basis_.to_world(l)), y.data());
    double sum = 0;
    for (std::size_t i = 0; i < kernel_.size(); ++i) sum += kernel_[i] * y[i];
    return {sum, sum, sum};
  }

 private:
  GgxLobe like_;
  Basis<double> basis_;
  const std::vector<double>& kernel_;
  int order_ = 1;
};

template <class Lobe>
void Estimator::add_lobe_sky(const PathVertex& v, const Lobe& lobe, PathNumbers& numbers,
                             std::vector<Vec3d>& sum) const {
  const Basis<double> basis = basis_around(v.normal);
  for (std::size_t k = 0; k < samplers_.size(); ++k) {
    if (!samplers_[k].useful()) continue;
    const Vec3d w = samplers_[k].sample(numbers.pair(0)), l = basis.to_local(w), value = lobe.value(l);
    if (value == Vec3d{} || tracer_.occluded(lifted(v), to_float(w), kFar)) continue;
    const double density = samplers_[k].density(w) + lobe.density(l);
    sum[k] += times(value / density, environment_radiance(light_.environments[k], to_float(w)));
  }
}

template <class Lobe>
int Estimator::add_lobe_path(const ReferencePoint& point, const Lobe& lobe, PathNumbers& numbers,
                             std::vector<Vec3d>& sum) const {
  const PathVertex v{to_double(point.position), normalized(to_double(point.normal)), to_double(point.face_normal)};
  if (!lobe.seen()) return 1;
  const Vec3d l = lobe.draw(numbers.pair(0));
  add_lobe_sky(v, lobe, numbers, sum);
  const double density = lobe.density(l);
  if (!(density > 0)) return 1;
  const Vec3d weight = lobe.value(l) / density, w = normalized(basis_around(v.normal).to_world(l));
  const Hit hit = tracer_.closest(lifted(v), to_float(w), kFar);
  if (!hit) {
    add_sky(w, density, weight, sum);
    return 1;
  }
  const SurfacePoint p = surface_point(scene_, hit.triangle, hit.u, hit.v);
  const Part& part = scene_.parts[scene_.mesh.part[hit.triangle]];
  if (hit.back && !scene_.materials[static_cast<std::size_t>(part.material)].double_sided) return 1;
  if (light_.scene_lights) sum.back() += times(weight, emission_at(scene_, p));
  const double side = hit.back ? -1 : 1;
  std::vector<Vec3d> there(sum.size());
  const int visited = add_path(
      {to_double(p.position), to_double(p.normal) * side, to_double(p.geometric_normal) * side}, numbers, there);
  for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += times(weight, albedo_at(scene_, p)) * there[k];
  return 1 + visited;
}

void check_light(const ReferenceLight& light) {
  EXPECTS(light.sh.empty() || (light.sh_order >= 1 && light.sh_order <= kMaxShOrder));
  for (const auto& coefficients : light.sh)
    EXPECTS(coefficients.size() == static_cast<std::size_t>(sh_count(light.sh_order)));
}

/// add(point, numbers, sum) for each sample of each point; it returns the vertices it visited.
template <class Add>
ReferenceResult estimate(const Estimator& estimator, std::size_t points, const ReferenceOptions& options,
                         Threads& threads, const Add& add) {
  const std::size_t lightings = estimator.lightings();
  const int half = (options.samples + 1) / 2;
  const std::vector<Vec3d> zero(lightings * points);
  ReferenceResult result{zero, zero, zero};
  BlockCounts vertices(points, 1);
  run_loop({.name = "reference",
            .items = points,
            .body =
                [&](std::size_t point, std::size_t) {
                  std::array<std::vector<Vec3d>, 2> sums{std::vector<Vec3d>(lightings), std::vector<Vec3d>(lightings)};
                  std::uint64_t visited = 0;
                  for (std::uint64_t sample = 0; sample < 2 * static_cast<std::uint64_t>(half); ++sample) {
                    PathNumbers numbers(options.seed, point, sample);
                    visited += static_cast<std::uint64_t>(add(point, numbers, sums[sample % 2]));
                  }
                  vertices.at(point) = visited;
                  for (std::size_t k = 0; k < lightings; ++k) {
                    const std::size_t i = k * points + point;
                    result.half_a[i] = sums[0][k] / half;
                    result.half_b[i] = sums[1][k] / half;
                    result.value[i] = (result.half_a[i] + result.half_b[i]) / 2.0;
                  }
                },
            .pass =
                [&](std::size_t begin, std::size_t end, ItemStream& stream) {
                  for (std::size_t i = begin; i < end; ++i) {
                    for (auto* values : {&result.half_a, &result.half_b, &result.value}) {
                      for (std::size_t k = 0; k < lightings; ++k) stream.pass((*values)[k * points + i]);
                    }
                  }
                  vertices.pass(begin, end, stream);
                }},
           threads);
  result.rays = vertices.sum() * estimator.rays_per_vertex();
  return result;
}

}  // namespace

ReferenceResult trace_reference(const Tracer& tracer, std::span<const ReferencePoint> points,
                                const ReferenceLight& light, const ReferenceOptions& options, Threads& threads) {
  EXPECTS(options.samples >= 1);
  check_light(light);
  const Estimator estimator(tracer, light, options);
  return estimate(
      estimator, points.size(), options, threads,
      [&](std::size_t point, PathNumbers& numbers, std::vector<Vec3d>& sum) {
        const ReferencePoint& p = points[point];
        const PathVertex start{to_double(p.position), normalized(to_double(p.normal)), to_double(p.face_normal)};
        return estimator.add_path(start, numbers, sum);
      });
}

ReferenceResult trace_specular(const Tracer& tracer, std::span<const EyedPoint> points, const ReferenceLight& light,
                               const ReferenceOptions& options, Threads& threads) {
  EXPECTS(options.samples >= 1);
  check_light(light);
  const Estimator estimator(tracer, light, options);
  return estimate(estimator, points.size(), options, threads,
                  [&](std::size_t point, PathNumbers& numbers, std::vector<Vec3d>& sum) {
                    return estimator.add_lobe_path(points[point].at, GgxLobe(points[point]), numbers, sum);
                  });
}

ReferenceResult trace_kernels(const Tracer& tracer, const KernelPoints& points, const ReferenceLight& light,
                              const ReferenceOptions& options, Threads& threads) {
  EXPECTS(options.samples >= 1 && points.kernel.size() == points.eyed.size());
  check_light(light);
  const Estimator estimator(tracer, light, options);
  return estimate(estimator, points.eyed.size(), options, threads,
                  [&](std::size_t point, PathNumbers& numbers, std::vector<Vec3d>& sum) {
                    const EyedPoint& eyed = points.eyed[point];
                    return estimator.add_lobe_path(eyed.at, KernelLobe(eyed, points.kernel[point]), numbers, sum);
                  });
}

}  // namespace kiln
