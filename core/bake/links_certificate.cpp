#include "core/bake/links_certificate.h"

#include <chrono>
#include <cmath>

#include "core/bake/spending.h"
#include "core/base/random.h"
#include "core/mesh/closest_point.h"
#include "core/mesh/topology.h"
#include "core/meshless/free_places.h"
#include "core/prt/hidden.h"
#include "core/trace/reference.h"
#include "core/trace/surface_samples.h"

namespace kiln {
namespace {

/// A point of the delivered surface, and where the reference stands for it.
struct CheckPoint {
  Triangle triangle{};
  float u = 0, v = 0;
  ReferencePoint truth;
  double weight = 1;
};

std::vector<CheckPoint> check_points(const LinksCheck& check, std::span<const double> density, std::size_t count,
                                     std::uint64_t seed) {
  const Mesh &shown = check.decoded.scene.mesh, &input = check.truth.scene().mesh;
  const HiddenTest hidden = hidden_test(check.truth);
  const ClosestPoint closest(input);
  std::vector<CheckPoint> out;
  for (const SurfaceSample& s : sample_surface(shown, count, seed, density)) {
    const SurfaceMatch here{s.triangle, s.u, s.v, 0};
    const auto there = closest.query(match_position(shown, here), match_normal(shown, here));
    if (!there) continue;
    const Vec3f position = to_float(match_position(input, *there)), normal = to_float(match_normal(input, *there));
    Vec3f face = normalized(area_vector(input, input.triangles[there->triangle]), normal);
    if (dot(face, normal) < 0) face = -face;
    if (hidden({position, normal, position, face})) continue;
    out.push_back({shown.triangles[s.triangle], s.u, s.v, {position, normal, face}, 1 / density[s.triangle]});
  }
  return out;
}

/// Of each triangle: as much for its area as for the lamps' light on it, each lamp's mean taken as 1.
std::vector<double> point_density(const Mesh& mesh, const std::vector<std::vector<Vec3f>>& light) {
  std::vector<double> out(mesh.triangles.size(), 1);
  for (const std::vector<Vec3f>& of_lamp : light) {
    std::vector<double> own;
    double sum = 0, area = 0;
    for (const Triangle& t : mesh.triangles) {
      double here = 0;
      for (const std::uint32_t v : t) here += (double{of_lamp[v].x} + double{of_lamp[v].y} + double{of_lamp[v].z}) / 9;
      own.push_back(here);
      sum += here * triangle_area(mesh, t), area += triangle_area(mesh, t);
    }
    const double scale = sum > 0 ? area / (sum * static_cast<double>(light.size())) : 0;
    for (std::size_t i = 0; i < own.size(); ++i) out[i] += own[i] * scale;
  }
  return out;
}

std::vector<double> weights_of(const std::vector<CheckPoint>& points) {
  std::vector<double> out;
  for (const CheckPoint& p : points) out.push_back(p.weight);
  return out;
}

std::vector<Light> certified_lamps(const LinksCheck& check, std::uint64_t seed) {
  std::vector<Light> out;
  for (const Vec3f& place : free_places(check.truth, kCertifiedLamps, seed)) {
    Light lamp{.position = place};
    const auto one = static_cast<float>(1 / (check.truth.scene().frame.scale * check.truth.scene().frame.scale));
    lamp.intensity = {one, one, one};
    out.push_back(lamp);
  }
  std::size_t own = 0;
  for (const Light& light : check.truth.scene().lights) {
    if (light.type == LightType::directional || own == kCertifiedLamps) continue;
    if (hangs_free(check.truth, light.position)) out.push_back(light), ++own;
  }
  return out;
}

std::vector<Vec3d> shown_at(const std::vector<std::vector<Vec3f>>& light, const std::vector<CheckPoint>& points) {
  std::vector<Vec3d> out;
  for (const std::vector<Vec3f>& of_lamp : light) {
    for (const CheckPoint& p : points) {
      out.push_back(to_double(of_lamp[p.triangle[0]] * (1 - p.u - p.v) + of_lamp[p.triangle[1]] * p.u +
                              of_lamp[p.triangle[2]] * p.v));
    }
  }
  return out;
}

}  // namespace

LinksCertificate certify_links(const LinksCheck& check, Threads& threads) {
  const auto start = std::chrono::steady_clock::now();
  const std::uint64_t seed = mix64(check.seed ^ 0x6c696e6b74727574ULL);
  const std::vector<Light> lamps = certified_lamps(check, seed);
  LinksCertificate out;
  std::vector<std::vector<Vec3f>> light;
  for (const Light& lamp : lamps) {
    out.lamps.push_back(check.truth.scene().frame.to_world(to_double(lamp.position)));
    light.push_back(reflected_light(check.links, lamp, check.truth, check.decoded.scene.mesh.normal, threads));
  }

  const auto trace = [&](const std::vector<CheckPoint>& points, int samples, std::uint64_t with) {
    std::vector<ReferencePoint> at;
    for (const CheckPoint& p : points) at.push_back(p.truth);
    const ReferenceOptions options{.samples = samples, .bounces = check.bounces, .from = 1, .seed = with};
    return trace_reference(check.truth, at, {.lamps = lamps}, options, threads);
  };
  const std::vector<double> density = point_density(check.decoded.scene.mesh, light);
  const std::vector<CheckPoint> few = check_points(check, density, Spending::kFewestPoints, mix64(seed));
  const ReferenceResult pilot = trace(few, Spending::kPilotSamples, mix64(seed + 1));
  const std::vector<Vec3d> pilot_noise = noise_from_halves(pilot.half_a, pilot.half_b);
  const ErrorStats known = compute_error({shown_at(light, few), pilot.value, pilot_noise, few.size(), weights_of(few)},
                                         {.seed = seed, .resamples = 1});
  const double paths = static_cast<double>(std::max<std::size_t>(few.size(), 1)) * Spending::kPilotSamples;
  const Spending spending =
      plan_spending(known, std::max(1.0, static_cast<double>(pilot.rays) / paths), check.bake_rays, check.thorough);

  const std::vector<CheckPoint> points = check_points(check, density, spending.points, mix64(seed + 2));
  const ReferenceResult truth = trace(points, spending.samples, mix64(seed + 3));
  const std::vector<Vec3d> values = shown_at(light, points), noise = noise_from_halves(truth.half_a, truth.half_b);
  out.points = points.size();
  out.samples = spending.samples;
  out.rays = pilot.rays + truth.rays;
  out.error = compute_error({values, truth.value, noise, points.size(), weights_of(points)}, {.seed = seed});
  double shown = 0, real = 0, wrong_squares = 0, squares = 0;
  for (std::size_t k = 0; k < lamps.size(); ++k) {
    double mean = 0, wrong = 0, all = 0, weight = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vec3d &t = truth.value[k * points.size() + i], &x = values[k * points.size() + i];
      const Vec3d& n = noise[k * points.size() + i];
      const double w = points[i].weight, doubt = n.x + n.y + n.z;
      weight += w, mean += w * (t.x + t.y + t.z) / 3, shown += x.x + x.y + x.z;
      wrong += w * (dot(x - t, x - t) - doubt), all += w * (dot(t, t) - doubt);
    }
    mean = weight > 0 ? mean / weight : 0;
    out.mean_light.push_back(mean);
    real += mean;
    if (mean > 0) wrong_squares += wrong / (mean * mean * weight), squares += all / (mean * mean * weight);
  }
  out.of_rms = squares > 0 ? std::sqrt(std::max(0.0, wrong_squares) / squares) : 0;
  out.dark = !(shown > 0) && !(real > 0);
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return out;
}

}  // namespace kiln
