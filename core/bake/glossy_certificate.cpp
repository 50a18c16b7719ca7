#include "core/bake/glossy_certificate.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include "core/artifact/eye.h"
#include "core/bake/eye_material.h"
#include "core/bake/lightings.h"
#include "core/base/random.h"
#include "core/mesh/closest_point.h"
#include "core/mesh/topology.h"
#include "core/trace/ggx.h"
#include "core/trace/reference.h"
#include "core/trace/surface.h"
#include "core/trace/surface_samples.h"

namespace kiln {
namespace {

constexpr std::size_t kPoints = 1024;

/// Points on the delivered surface and their places on the input's.
struct Eyes {
  std::vector<EyePoint> shown;
  std::vector<EyedPoint> truth;
  std::vector<ReferencePoint> below;        // the places of `truth`
  std::vector<Vec3d> diffuse;               // reflectance there, below the specular layer
  std::vector<Vec3d> albedo;                // of that layer: F0 a + b
  std::vector<std::vector<double>> kernel;  // the lobe in the bands of the matrices
};

EyedPoint eyed_point(const Scene& scene, const SurfaceMatch& match, const Vec3d& view, const EyeMaterial& material) {
  Vec3f face = area_vector(scene.mesh, scene.mesh.triangles[match.triangle]);
  const Vec3f normal = to_float(match_normal(scene.mesh, match));
  if (dot(face, normal) < 0) face = -face;
  return {{to_float(match_position(scene.mesh, match)), normal, normalized(face, normal)},
          to_float(view),
          ggx_alpha(material.roughness),
          material.f0};
}

Eyes open_eyes(const BakedScene& baked, const Scene& input, std::uint64_t seed) {
  const Mesh& mesh = baked.scene.mesh;
  std::vector<double> density;
  for (const Triangle& t : mesh.triangles) density.push_back(has_matrices(baked.glossy, t) ? 1 : 0);
  const ClosestPoint nearest(input.mesh);
  Eyes out;
  std::uint64_t item = 0;
  for (const SurfaceSample& s : sample_surface(mesh, kPoints, mix64(seed ^ 0x65796573ULL), density)) {
    Random random(seed, item++, 0x65796573ULL);
    const SurfaceMatch here{s.triangle, s.u, s.v, 0};
    const Vec3d normal = match_normal(mesh, here);
    const auto match = nearest.query(match_position(mesh, here), normal);
    if (!match) continue;
    const Vec3d there = match_normal(input.mesh, *match), view = random_view(there, random);
    const SurfacePoint at =
        surface_point(input, match->triangle, static_cast<float>(match->u), static_cast<float>(match->v));
    const EyeMaterial material = eye_material(input, at);
    out.shown.push_back({{mesh.triangles[s.triangle], s.u, s.v},
                         normal,
                         view,
                         eye_material(baked.scene, surface_point(baked.scene, s.triangle, s.u, s.v))});
    out.truth.push_back(eyed_point(input, *match, view, material));
    out.below.push_back(out.truth.back().at);
    const Lobe lobe = lobe_at(baked.lobes, dot(there, view), material.roughness);
    out.diffuse.push_back(material.diffuse * (1 - lobe.kept()));
    out.albedo.push_back(lobe.albedo(material.f0));
    const LobeKernel kernel = lobe_kernel(lobe, there, view);
    out.kernel.emplace_back(kernel.begin(), kernel.begin() + sh_count(lobe.order));
  }
  return out;
}

/// Index: lighting * points + point.
struct Values {
  std::vector<Vec3d> shown, truth, half_a, half_b;

  ErrorStats judge(std::size_t points, std::uint64_t seed) const {
    const std::vector<Vec3d> noise = noise_from_halves(half_a, half_b);
    return compute_error({shown, truth, noise, points}, {.seed = seed});
  }
  /// Only the lightings that are kept.
  Values of(const std::vector<bool>& kept, std::size_t points) const {
    Values out;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      if (!kept[i / points]) continue;
      out.shown.push_back(shown[i]);
      out.truth.push_back(truth[i]);
      out.half_a.push_back(half_a[i]);
      out.half_b.push_back(half_b[i]);
    }
    return out;
  }
};

/// What the reference says of the eyes.
struct Truths {
  ReferenceResult diffuse;   // of white Lambertian points
  ReferenceResult specular;  // of lobes
  ReferenceResult bands;     // of lobes in the bands of the matrices
};

/// Adds one value of the reference and its halves: `below` of what is diffuse and `above` of what is specular.
void add_truth(Values& out, const Vec3d& below, const ReferenceResult& diffuse, const Vec3d& above,
               const ReferenceResult& specular, std::size_t i) {
  out.truth.push_back(below * diffuse.value[i] + above * specular.value[i]);
  out.half_a.push_back(below * diffuse.half_a[i] + above * specular.half_a[i]);
  out.half_b.push_back(below * diffuse.half_b[i] + above * specular.half_b[i]);
}

/// Everything about one run of the reference: of each lighting radiance and specular part, and the job's own light.
struct Judged {
  Values radiance, specular, transport, truncation, job;
};

Judged look(const BakedScene& baked, const Eyes& eyes, const ReferenceLight& light, const Truths& truths) {
  const ReferenceResult &diffuse = truths.diffuse, &specular = truths.specular;
  const std::size_t points = eyes.truth.size(), skipped = light.environments.size();
  const std::size_t all = points == 0 ? 0 : diffuse.value.size() / points;
  Judged out;
  const auto add = [&](std::size_t k, const EyeLight& own) {
    for (std::size_t p = 0; p < points; ++p) {
      const std::size_t i = k * points + p;
      const EyeRadiance shown = eye_radiance(baked, own, eyes.shown[p]);
      const Vec3d &below = eyes.diffuse[p], one{1, 1, 1};
      for (Values* values : {&out.radiance, &out.transport}) values->shown.push_back(shown.diffuse + shown.specular);
      out.specular.shown.push_back(shown.specular);
      add_truth(out.radiance, below, diffuse, one, specular, i);
      add_truth(out.specular, {}, diffuse, one, specular, i);
      add_truth(out.transport, below, diffuse, eyes.albedo[p], truths.bands, i);
      // Bands minus lobe, as an error of the whole radiance.
      out.truncation.shown.push_back(out.transport.truth.back());
      out.truncation.truth.push_back(out.radiance.truth.back());
      const Vec3d a = eyes.albedo[p] * truths.bands.half_a[i] - specular.half_a[i];
      const Vec3d b = eyes.albedo[p] * truths.bands.half_b[i] - specular.half_b[i];
      out.truncation.half_a.push_back(a);
      out.truncation.half_b.push_back(b);
    }
  };
  for (std::size_t k = 0; k < light.sh.size(); ++k) {
    std::vector<Vec3f> padded = light.sh[k];
    padded.resize(static_cast<std::size_t>(sh_count(baked.transfer.order)));
    add(skipped + k, eye_light(baked, std::move(padded), false));
  }
  if (light.scene_lights) add(all - 1, eye_light(baked, {}, true));
  if (skipped == 0 && !light.scene_lights) return out;
  // The job's environment in full is the first lighting, the lamps are the last.
  const EyeLight own = eye_light(baked, baked.light.parts());
  for (std::size_t p = 0; p < points; ++p) {
    const EyeRadiance shown = eye_radiance(baked, own, eyes.shown[p]);
    const auto together = [&](const std::vector<Vec3d>& below, const std::vector<Vec3d>& above) {
      Vec3d sum;
      if (skipped > 0) sum += eyes.diffuse[p] * below[p] + above[p];
      if (light.scene_lights) sum += eyes.diffuse[p] * below[(all - 1) * points + p] + above[(all - 1) * points + p];
      return sum;
    };
    out.job.shown.push_back(shown.diffuse + shown.specular);
    out.job.truth.push_back(together(diffuse.value, specular.value));
    out.job.half_a.push_back(together(diffuse.half_a, specular.half_a));
    out.job.half_b.push_back(together(diffuse.half_b, specular.half_b));
  }
  return out;
}

/// Lightings of which a twentieth of what the one that reaches most brings is seen; lamps if they are seen at all.
std::vector<bool> kept_lightings(const Values& radiance, const Lightings& lightings, std::size_t points) {
  constexpr double kFaint = 0.05;
  std::vector<double> seen;
  for (std::size_t first = 0; first + points <= radiance.truth.size() && points > 0; first += points) {
    double sum = 0;
    for (std::size_t i = first; i < first + points; ++i) {
      const Vec3d& x = radiance.truth[i];
      sum += (std::abs(x.x) + std::abs(x.y) + std::abs(x.z)) / (3 * static_cast<double>(points));
    }
    const std::size_t k = seen.size();
    double sent = 1;
    if (k < lightings.sh.size())
      sent = (double{lightings.sh[k][0].x} + lightings.sh[k][0].y + lightings.sh[k][0].z) / 3;
    seen.push_back(sent > 0 ? sum / sent : 0);
  }
  double most = 0;
  for (std::size_t k = 0; k < std::min(seen.size(), lightings.sh.size()); ++k) most = std::max(most, seen[k]);
  std::vector<bool> out;
  for (std::size_t k = 0; k < seen.size(); ++k) out.push_back(seen[k] > (k < lightings.sh.size() ? kFaint * most : 0));
  return out;
}

}  // namespace

GlossyCertificate certify_glossy(const BakedScene& decoded, const Tracer& truth,
                                 const std::optional<Environment>& environment, const CertificateOptions& options,
                                 Threads& threads) {
  const auto start = std::chrono::steady_clock::now();
  BakedLight own = decoded.light;
  own.coefficients.resize(std::min(own.coefficients.size(), static_cast<std::size_t>(decoded.glossy.outputs())));
  const Lightings lightings = test_lightings(decoded.glossy.order, own);
  ReferenceLight light;
  if (environment) light.environments.push_back(*environment);
  light.sh_order = decoded.glossy.order;
  light.sh = lightings.sh;
  light.scene_lights = decoded.glossy.fixed;

  const Eyes eyes = open_eyes(decoded, truth.scene(), options.seed);
  GlossyCertificate out;
  out.points = eyes.truth.size();
  // A path costs about eighteen rays of a packet; 5 % of the bake's.
  constexpr double kPathsOfRay = 0.05 / 18 / kPoints;
  out.samples = static_cast<int>(std::clamp(kPathsOfRay * static_cast<double>(options.bake_rays), 64.0, 1024.0));
  const ReferenceOptions paths{.samples = out.samples, .seed = mix64(options.seed ^ 0x6c6f6265ULL)};
  const ReferenceOptions again{.samples = out.samples, .seed = mix64(paths.seed)};
  const ReferenceOptions more{.samples = out.samples, .seed = mix64(again.seed)};
  Truths truths{.specular = trace_specular(truth, eyes.truth, light, again, threads),
                .bands = trace_kernels(truth, {eyes.truth, eyes.kernel}, light, more, threads)};
  // Metals have nothing below.
  const bool metals = std::ranges::all_of(eyes.diffuse, [](const Vec3d& d) { return d == Vec3d{}; });
  const std::vector<Vec3d> nothing(truths.specular.value.size());
  truths.diffuse =
      metals ? ReferenceResult{nothing, nothing, nothing} : trace_reference(truth, eyes.below, light, paths, threads);

  const Judged judged = look(decoded, eyes, light, truths);
  const std::vector<bool> kept = kept_lightings(judged.radiance, lightings, out.points);
  for (std::size_t k = 0; k < kept.size(); ++k)
    (kept[k] ? out.lightings : out.dark).push_back(k < lightings.names.size() ? lightings.names[k] : "lamps");
  out.radiance = judged.radiance.of(kept, out.points).judge(out.points, options.seed);
  out.specular = judged.specular.of(kept, out.points).judge(out.points, options.seed);
  out.transport = judged.transport.of(kept, out.points).judge(out.points, options.seed);
  out.truncation = judged.truncation.of(kept, out.points).judge(out.points, options.seed);
  if (!judged.job.truth.empty()) out.job_light = judged.job.judge(out.points, options.seed);
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return out;
}

}  // namespace kiln
