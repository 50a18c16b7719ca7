#include "core/bake/certificate.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <span>

#include "core/artifact/evaluate.h"
#include "core/bake/lightings.h"
#include "core/bake/second_look.h"
#include "core/bake/spending.h"
#include "core/base/random.h"
#include "core/mesh/closest_point.h"
#include "core/mesh/topology.h"
#include "core/prt/hidden.h"
#include "core/trace/reference.h"
#include "core/trace/surface_samples.h"

namespace kiln {
namespace {

/// Points on the delivered surface and their places on the input's.
struct Probe {
  std::vector<TrianglePoint> delivered;
  std::vector<ReferencePoint> truth;
  std::vector<double> weight;  // one over the density they were drawn with
};

/// What the constant band and the lamps bring to a vertex, each relative to its mean over the vertices.
std::vector<double> relative_light(const Transfer& transfer, std::size_t vertices) {
  std::vector<double> out(vertices, 0.0);
  const auto add = [&](int slot) {
    std::vector<double> light(vertices);
    double mean = 0;
    for (std::size_t v = 0; v < vertices; ++v) {
      for (int c = 0; c < transfer.channels; ++c) light[v] += transfer.at(v, c)[slot];
      mean += std::abs(light[v]) / static_cast<double>(vertices);
    }
    for (std::size_t v = 0; mean > 0 && v < vertices; ++v) out[v] += light[v] / mean;
  };
  add(0);
  if (transfer.fixed) add(transfer.slots() - 1);
  return out;
}

/// Errors lie where light changes, or beside it: a strip of floor under a column is a thousandth of the surface, three
/// quarters of the squared error, and takes its light from the vertex outside. Half of the points are drawn there: in
/// proportion to how light differs over a triangle or one that shares a corner with it. Mean over the surface: 1.
std::vector<double> probe_density(const BakedScene& baked) {
  const Mesh& mesh = baked.scene.mesh;
  const std::vector<double> light = relative_light(baked.transfer, mesh.position.size());
  std::vector<double> change(mesh.position.size(), 0.0), density(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    const auto [least, most] = std::minmax({light[t[0]], light[t[1]], light[t[2]]});
    for (const std::uint32_t v : t) change[v] = std::max(change[v], most - least);
  }
  double area = 0, sum = 0;
  for (std::size_t i = 0; i < density.size(); ++i) {
    const Triangle& t = mesh.triangles[i];
    density[i] = std::max({change[t[0]], change[t[1]], change[t[2]]});
    area += triangle_area(mesh, t);
    sum += density[i] * triangle_area(mesh, t);
  }
  for (double& d : density) d = sum > 0 ? 0.5 + 0.5 * d * area / sum : 1;
  return density;
}

Probe probe_surface(const Mesh& delivered, const std::vector<double>& density, const Mesh& input, std::size_t points,
                    std::uint64_t seed) {
  const ClosestPoint nearest(input);
  Probe probe;
  for (const SurfaceSample& s : sample_surface(delivered, points, mix64(seed ^ 0x636572746966ULL), density)) {
    const SurfaceMatch here{s.triangle, s.u, s.v, 0};
    const auto match = nearest.query(match_position(delivered, here), match_normal(delivered, here));
    if (!match) continue;
    probe.delivered.push_back({delivered.triangles[s.triangle], s.u, s.v});
    probe.weight.push_back(1 / density[s.triangle]);
    Vec3f face = area_vector(input, input.triangles[match->triangle]);
    const Vec3f normal = to_float(match_normal(input, *match));
    if (dot(face, normal) < 0) face = -face;
    probe.truth.push_back({to_float(match_position(input, *match)), normal, normalized(face, normal)});
  }
  return probe;
}

/// What the artefact shows under each lighting, the lamps last and alone: the fixed slot under darkness.
std::vector<Vec3d> shown_values(const BakedScene& baked, const Probe& probe, const Lightings& lightings) {
  std::vector<Vec3d> out;
  for (const auto& light : lightings.sh) {
    for (const TrianglePoint& p : probe.delivered) {
      out.push_back(to_double(distant_value_at(baked.transfer, p, light)));
    }
  }
  if (baked.transfer.fixed) {
    for (const TrianglePoint& p : probe.delivered) out.push_back(to_double(value_at(baked.transfer, p, {})));
  }
  return out;
}

double mean_size(std::span<const Vec3d> values, std::span<const double> weights) {
  double sum = 0, all = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    sum += weights[i] * (std::abs(values[i].x) + std::abs(values[i].y) + std::abs(values[i].z)) / 3;
    all += weights[i];
  }
  return all > 0 ? sum / all : 0;
}

/// The mean value of unoccluded points of all directions: the constant band of the light.
double open_value(const std::vector<Vec3f>& light) {
  return (light[0].x + light[0].y + light[0].z) / 3 * 0.28209479177387814;  // Y(0,0)
}

/// The mean value there would be if all that the lamps send fell on the surface evenly; textures count as white.
double lamp_value(const Scene& scene) {
  const auto mean = [](const Vec3f& c) { return (double{c.x} + c.y + c.z) / 3; };
  double sent = 0, area = 0, even = 0;
  for (std::size_t t = 0; t < scene.mesh.triangles.size(); ++t) {
    const auto part = scene.parts[scene.mesh.part[t]];
    const double a = triangle_area(scene.mesh, scene.mesh.triangles[t]);
    area += a;
    sent += a * mean(scene.materials[static_cast<std::size_t>(part.material)].emission);
  }
  for (const Light& light : scene.lights) {
    if (light.type == LightType::directional) {
      even += mean(light.intensity) / std::numbers::pi;
    } else {
      sent += 4 * mean(light.intensity);
    }
  }
  return even + (area > 0 ? sent / area : 0);
}

/// Everything known at the probed points. Index: lighting * points + point.
struct Samples {
  std::vector<Vec3d> shown, truth, noise;

  void append(const Samples& from, std::size_t first, std::size_t count) {
    const auto add = [&](std::vector<Vec3d>& to, const std::vector<Vec3d>& all) {
      to.insert(to.end(), all.begin() + static_cast<std::ptrdiff_t>(first),
                all.begin() + static_cast<std::ptrdiff_t>(first + count));
    };
    add(shown, from.shown);
    add(truth, from.truth);
    add(noise, from.noise);
  }
};

/// How much of each lighting reaches the surface, in truth or in the artefact; of the lamps last.
std::vector<double> reach_of(const Samples& all, const Lightings& lightings, double lamps,
                             std::span<const double> weights) {
  const std::size_t points = weights.size();
  std::vector<double> reach;
  for (std::size_t k = 0; k < lightings.sh.size() + (lamps > 0 ? 1 : 0); ++k) {
    const double whole = k < lightings.sh.size() ? open_value(lightings.sh[k]) : lamps;
    const double seen = std::max(mean_size(std::span(all.truth).subspan(k * points, points), weights),
                                 mean_size(std::span(all.shown).subspan(k * points, points), weights));
    reach.push_back(whole > 0 ? seen / whole : 0);
  }
  return reach;
}

/// The lightings that matter here; the others are named in certificate.dark.
Samples judged_lightings(const Samples& all, const Lightings& lightings, double lamps, std::span<const double> weights,
                         Certificate& certificate) {
  constexpr double kDark = 0.01, kDarkLamps = 1e-4;  // a lamp's texture may be black nearly everywhere
  constexpr double kFaint = 0.05;                    // of the lighting that reaches most
  Samples judged;
  const std::size_t points = certificate.points, distant = lightings.sh.size();
  const std::vector<double> reach = reach_of(all, lightings, lamps, weights);
  const double most = *std::max_element(reach.begin(), reach.begin() + static_cast<std::ptrdiff_t>(distant));
  for (std::size_t k = 0; k < reach.size(); ++k) {
    const std::string name = k < distant ? lightings.names[k] : "lamps";
    if (reach[k] <= (k < distant ? std::max(kDark, kFaint * most) : kDarkLamps)) {
      certificate.dark.push_back(name);
      continue;
    }
    certificate.lightings.push_back(name);
    certificate.mean_light.push_back(mean_size(std::span(all.truth).subspan(k * points, points), weights));
    judged.append(all, k * points, points);
  }
  return judged;
}

/// Of light that cannot be turned there is one lighting, the job's; a scene lit by nothing has error 0.
Samples judged_job_light(const Samples& all, std::span<const double> weights, Certificate& certificate) {
  const double truth = mean_size(all.truth, weights), shown = mean_size(all.shown, weights);
  if (all.truth.empty() || (!(truth > 0) && !(shown > 0))) {
    certificate.dark.push_back("job light");
    return {};
  }
  certificate.lightings.push_back("job light");
  certificate.mean_light.push_back(truth);
  return all;
}

ErrorStats statistics(const Samples& samples, std::span<const double> weights, std::uint64_t seed) {
  return compute_error({samples.shown, samples.truth, samples.noise, weights.size(), weights}, {.seed = seed});
}

/// The same samples at some of the points only.
Samples at_points(const Samples& all, const std::vector<std::size_t>& chosen, std::size_t points) {
  Samples out;
  for (std::size_t first = 0; first < all.truth.size(); first += points) {
    for (const std::size_t p : chosen) out.append(all, first + p, 1);
  }
  return out;
}

std::vector<double> at(const std::vector<double>& weights, const std::vector<std::size_t>& chosen) {
  std::vector<double> out;
  for (const std::size_t p : chosen) out.push_back(weights[p]);
  return out;
}

std::vector<std::size_t> seen_points(const Tracer& truth, const std::vector<ReferencePoint>& points) {
  const HiddenTest hidden = hidden_test(truth);
  std::vector<std::size_t> seen;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto& [position, normal, face_normal] = points[i];
    if (!hidden({position, normal, position, face_normal})) seen.push_back(i);
  }
  return seen;
}

/// What a run of the reference at some points tells.
struct Judgement {
  Samples transport;  // of all lightings
  Samples job_light;  // empty: the job has none
  std::uint64_t rays = 0;
};

/// The job's environment in full (the reference's first lighting) and the lamps (its last), seen together.
Samples job_light_samples(const BakedScene& baked, const Probe& probe, const ReferenceLight& light,
                          const ReferenceResult& reference) {
  const std::size_t points = probe.truth.size(), last = reference.value.size() - points;
  if (points == 0 || (light.environments.empty() && !light.scene_lights)) return {};
  const auto together = [&](const std::vector<Vec3d>& values, std::size_t point) {
    Vec3d sum;
    if (!light.environments.empty()) sum += values[point];
    if (light.scene_lights) sum += values[last + point];
    return sum;
  };
  Samples out;
  std::vector<Vec3d> half_a, half_b;
  for (std::size_t i = 0; i < points; ++i) {
    out.shown.push_back(to_double(shown_at(baked.transfer, probe.delivered[i], baked.light.parts())));
    out.truth.push_back(together(reference.value, i));
    half_a.push_back(together(reference.half_a, i));
    half_b.push_back(together(reference.half_b, i));
  }
  out.noise = noise_from_halves(half_a, half_b);
  return out;
}

/// The light of the reference: the job's environment in full, then the test lightings, then the lamps.
ReferenceLight reference_light(const BakedScene& baked, const std::optional<Environment>& environment,
                               const Lightings& lightings) {
  ReferenceLight light;
  if (environment) light.environments.push_back(*environment);
  light.sh_order = baked.transfer.order;
  light.sh = lightings.sh;
  light.scene_lights = baked.transfer.fixed;  // of order 0 always: it holds the job's light, lamps and all
  return light;
}

class Judge {
 public:
  Judge(const BakedScene& baked, const Tracer& truth, const std::optional<Environment>& environment, Threads& threads)
      : baked_(baked),
        truth_(truth),
        threads_(threads),
        lightings_(baked.transfer.order > 0 ? test_lightings(baked.transfer.order, baked.light) : Lightings{}),
        light_(reference_light(baked, environment, lightings_)) {}

  Judgement judge(const Probe& probe, int samples, std::uint64_t seed) const {
    const ReferenceResult reference =
        trace_reference(truth_, probe.truth, light_, {.samples = samples, .seed = seed}, threads_);
    const Samples full{{}, reference.value, noise_from_halves(reference.half_a, reference.half_b)};
    const std::size_t skipped = light_.environments.size() * probe.truth.size();
    const auto kept = [&](const std::vector<Vec3d>& all) {
      return std::vector<Vec3d>(all.begin() + static_cast<std::ptrdiff_t>(skipped), all.end());
    };
    Samples together = job_light_samples(baked_, probe, light_, reference);
    if (baked_.transfer.order == 0) return {std::move(together), {}, reference.rays};
    return {{shown_values(baked_, probe, lightings_), kept(full.truth), kept(full.noise)},
            std::move(together),
            reference.rays};
  }

  Samples judged(const Judgement& all, std::span<const double> weights, Certificate& certificate) const {
    if (baked_.transfer.order == 0) return judged_job_light(all.transport, weights, certificate);
    return judged_lightings(all.transport, lightings_, light_.scene_lights ? lamp_value(truth_.scene()) : 0, weights,
                            certificate);
  }

 private:
  const BakedScene& baked_;
  const Tracer& truth_;
  Threads& threads_;
  Lightings lightings_;
  ReferenceLight light_;
};

/// The squared difference and its noise at each point, in the lighting where they are the largest.
std::vector<double> doubts(const Judgement& all, std::span<const double> weights) {
  const std::size_t points = weights.size();
  std::vector<double> part(points, 0.0);
  for (const Samples* samples : {&all.transport, &all.job_light}) {
    for (std::size_t first = 0; first < samples->truth.size(); first += points) {
      const double mean = mean_size(std::span(samples->truth).subspan(first, points), weights);
      for (std::size_t p = 0; mean > 0 && p < points; ++p) {
        const Vec3d d = (samples->shown[first + p] - samples->truth[first + p]) / mean;
        const Vec3d& noise = samples->noise[first + p];
        part[p] = std::max(part[p], weights[p] * (dot(d, d) + (noise.x + noise.y + noise.z) / (mean * mean)));
      }
    }
  }
  return part;
}

void replace(Samples& all, std::size_t points, const std::vector<std::size_t>& chosen, const Samples& by) {
  for (std::size_t first = 0, from = 0; first < all.truth.size(); first += points) {
    for (const std::size_t p : chosen) {
      all.truth[first + p] = by.truth[from];
      all.noise[first + p] = by.noise[from++];
    }
  }
}

/// A path that finds a lamp by chance is an error of the reference that its own noise does not tell. So the points of
/// the largest errors are looked at again, with many more paths that know nothing of the first.
void look_again(Judgement& all, const Judge& judge, const Probe& probe, int samples, std::uint64_t seed) {
  const std::vector<std::size_t> doubtful = doubtful_points(doubts(all, probe.weight));
  Probe again;
  for (const std::size_t p : doubtful) {
    again.delivered.push_back(probe.delivered[p]);
    again.truth.push_back(probe.truth[p]);
    again.weight.push_back(probe.weight[p]);
  }
  const Judgement known = judge.judge(again, kMorePaths * samples, mix64(seed ^ 0x616761696eULL));
  replace(all.transport, probe.truth.size(), doubtful, known.transport);
  replace(all.job_light, probe.truth.size(), doubtful, known.job_light);
}

}  // namespace

Certificate certify(const BakedScene& decoded, const Tracer& truth, const std::optional<Environment>& environment,
                    const CertificateOptions& options, Threads& threads) {
  const auto start = std::chrono::steady_clock::now();
  const Judge judge(decoded, truth, environment, threads);
  const std::uint64_t seed = mix64(options.seed ^ 0x7472757468ULL);
  const std::vector<double> density = probe_density(decoded);
  const auto probe = [&](std::size_t points) {
    return probe_surface(decoded.scene.mesh, density, truth.scene().mesh, points, options.seed);
  };

  Certificate pilot;
  const Probe few = probe(Spending::kFewestPoints);
  pilot.points = few.truth.size();
  const Judgement first = judge.judge(few, Spending::kPilotSamples, mix64(seed));
  const Samples judged = judge.judged(first, few.weight, pilot);
  const ErrorStats known = compute_error({judged.shown, judged.truth, judged.noise, pilot.points, few.weight},
                                         {.seed = options.seed, .resamples = 1});
  const double paths = static_cast<double>(std::max<std::size_t>(pilot.points, 1)) * Spending::kPilotSamples;
  const Spending spending =
      plan_spending(known, std::max(1.0, static_cast<double>(first.rays) / paths), options.bake_rays, options.thorough);

  Certificate out;
  const Probe many = probe(spending.points);
  out.points = many.truth.size();
  out.samples = spending.samples;
  Judgement all = judge.judge(many, spending.samples, seed);
  look_again(all, judge, many, spending.samples, seed);
  const Samples transport = judge.judged(all, many.weight, out);
  out.transport = statistics(transport, many.weight, options.seed);
  if (const auto seen = seen_points(truth, many.truth); seen.size() < out.points)
    out.seen = statistics(at_points(transport, seen, out.points), at(many.weight, seen), options.seed);
  if (!all.job_light.truth.empty()) out.job_light = statistics(all.job_light, many.weight, options.seed);
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return out;
}

}  // namespace kiln
