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

std::vector<TransferPoint> places_of(const std::vector<CheckPoint>& points) {
  std::vector<TransferPoint> out;
  for (const CheckPoint& p : points)
    out.push_back({p.truth.position, p.truth.normal, p.truth.position, p.truth.face_normal});
  return out;
}

/// What one lamp does, by the decoded links.
struct Lit {
  std::vector<VectorValue> rows;
  std::vector<Vec3f> vertices;
};

/// Of each triangle: as much for its area as for the lamps' light on it, each lamp's mean taken as 1.
std::vector<double> point_density(const Mesh& mesh, const std::vector<Lit>& light) {
  std::vector<double> out(mesh.triangles.size(), 1);
  for (const Lit& lit : light) {
    const std::vector<Vec3f>& of_lamp = lit.vertices;
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

/// Points all over the surface, for what rows lose.
std::vector<CheckPoint> even_points(const LinksCheck& check, std::uint64_t seed) {
  constexpr std::size_t kPlaces = 256;
  const std::vector<double> even(check.decoded.scene.mesh.triangles.size(), 1);
  return check_points(check, even, kPlaces, seed);
}

std::vector<double> weights_of(const std::vector<CheckPoint>& points) {
  std::vector<double> out;
  for (const CheckPoint& p : points) out.push_back(p.weight);
  return out;
}

std::vector<Light> certified_lamps(const LinksCheck& check, std::uint64_t seed) {
  std::vector<Light> out;
  for (const Vec3f& place : free_places(check.truth, (check.thorough ? 2 : 1) * kCertifiedLamps, seed)) {
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

Lit lit_by(const Light& lamp, const LinksCheck& check, Threads& threads) {
  const std::vector<Vec3f> nodes = solve_nodes(check.links, light_senders(check.links, lamp, check.truth, threads));
  Lit out{.rows = gather_links(check.links, nodes, threads), .vertices = {}};
  out.vertices = read_rows(check.links, out.rows, check.decoded.scene.mesh.normal, threads);
  return out;
}

Vec3d shown_at(const Lit& light, const CheckPoint& p) {
  const auto& [a, b, c] = p.triangle;
  return to_double(light.vertices[a] * (1 - p.u - p.v) + light.vertices[b] * p.u + light.vertices[c] * p.v);
}

std::vector<Vec3d> shown_at(const std::vector<Lit>& light, const std::vector<CheckPoint>& points) {
  std::vector<Vec3d> out;
  for (const Lit& of_lamp : light) {
    for (const CheckPoint& p : points) out.push_back(shown_at(of_lamp, p));
  }
  return out;
}

/// As if each point were a vertex; where it sees no receiver, what is shown.
std::vector<Vec3d> read_at(const std::vector<Lit>& light, const std::vector<CheckPoint>& points,
                           const LinksCheck& check, Threads& threads) {
  const std::vector<std::vector<RowTerm>> terms = check.builder->readings_at(places_of(points), threads);
  std::vector<Vec3d> out;
  for (const Lit& of_lamp : light) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      Vec3f sum;
      for (const RowTerm& t : terms[i])
        sum += of_lamp.rows[t.row].at(points[i].truth.normal) * (static_cast<float>(t.weight) / 255);
      out.push_back(terms[i].empty() ? shown_at(of_lamp, points[i]) : to_double(sum));
    }
  }
  return out;
}

/// The interval of compute_error is about other points. Whoever moves a lamp has other lamps too: the spread of the
/// lamps' squared errors, by Student's t for their number, is added to both ends.
void allow_for_lamps(ErrorStats& error) {
  const auto n = static_cast<double>(error.by_lighting.size());
  if (n < 2) return;
  const double mean = error.relrmse * error.relrmse;
  double spread = 0;
  for (const double e : error.by_lighting) spread += (e * e - mean) * (e * e - mean);
  const double t = 1.96 + 2.8 / (n - 1);  // within 1 % of the 97.5 % point for 8 and more
  const double lamps = t * std::sqrt(spread / (n * (n - 1)));
  const auto moved = [&](double end, double sign) {
    return std::sqrt(std::max(0.0, mean + sign * std::hypot(end * end - mean, lamps)));
  };
  error.interval_low = moved(error.interval_low, -1);
  error.interval_high = moved(error.interval_high, 1);
}

/// `read` is the error of links that are read at the points themselves.
LinkSources split(double whole, double read, const LinkErrors& rows) {
  const auto square = [](double x) { return x * x; };
  LinkSources out;
  out.interpolation = std::sqrt(std::max(0.0, square(whole) - square(read)));
  double left = square(std::min(whole, read));
  out.noise = std::min(rows.noise, std::sqrt(left));
  left = std::max(0.0, left - square(out.noise));
  out.links = std::min(rows.links, std::sqrt(left));
  out.senders = std::sqrt(std::max(0.0, left - square(out.links)));
  return out;
}

}  // namespace

LinksCertificate certify_links(const LinksCheck& check, Threads& threads) {
  const auto start = std::chrono::steady_clock::now();
  const std::uint64_t seed = mix64(check.seed ^ 0x6c696e6b74727574ULL);
  const std::vector<Light> lamps = certified_lamps(check, seed);
  LinksCertificate out;
  std::vector<Lit> light;
  for (const Light& lamp : lamps) {
    out.lamps.push_back(check.truth.scene().frame.to_world(to_double(lamp.position)));
    light.push_back(lit_by(lamp, check, threads));
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
  const std::vector<double> weights = weights_of(points);
  const auto error_of = [&](std::span<const Vec3d> light, bool of_rms, int resamples) {
    const ErrorInput in{light, truth.value, noise, points.size(), weights, of_rms};
    return compute_error(in, {.seed = seed, .resamples = resamples});
  };
  out.error = error_of(values, false, 1000);
  out.of_rms = error_of(values, true, 1000);
  allow_for_lamps(out.of_rms);
  if (check.builder != nullptr) {
    const double read = error_of(read_at(light, points, check, threads), true, 1).relrmse;
    const std::vector<TransferPoint> places = places_of(even_points(check, mix64(seed + 4)));
    out.sources = split(out.of_rms.relrmse, read, check.builder->errors_at(places, threads));
  }
  double shown = 0, real = 0;
  for (std::size_t k = 0; k < lamps.size(); ++k) {
    double mean = 0, weight = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vec3d &t = truth.value[k * points.size() + i], &x = values[k * points.size() + i];
      weight += weights[i], mean += weights[i] * (t.x + t.y + t.z) / 3, shown += x.x + x.y + x.z;
    }
    out.mean_light.push_back(weight > 0 ? mean / weight : 0);
    real += out.mean_light.back();
  }
  out.dark = !(shown > 0) && !(real > 0);
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return out;
}

}  // namespace kiln
