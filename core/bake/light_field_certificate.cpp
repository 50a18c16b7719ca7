#include "core/bake/light_field_certificate.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/bake/eye_material.h"
#include "core/base/random.h"
#include "core/lightfield/seen.h"
#include "core/mesh/closest_point.h"
#include "core/mesh/topology.h"
#include "core/prt/hidden.h"
#include "core/prt/lobe_table.h"
#include "core/trace/highlights.h"
#include "core/trace/reference.h"
#include "core/trace/surface.h"
#include "core/trace/surface_samples.h"

namespace kiln {
namespace {

constexpr std::size_t kPoints = 1024;

/// Points on the delivered surface and their places on the input's.
struct Eyes {
  std::vector<Vec3d> shown;  // what the file shows
  std::vector<EyedPoint> truth;
  std::vector<ReferencePoint> below;  // the places of `truth`
  std::vector<Vec3d> reflected;       // by the diffuse layer towards the eye, of its light
  std::vector<Vec3d> known;           // emission and highlights of punctual lights
};

Eyes open_eyes(const FieldCheck& check) {
  const Scene& input = check.truth.scene();
  const Mesh& mesh = check.decoded.scene.mesh;
  const HiddenTest hidden = hidden_test(check.truth);
  const ClosestPoint nearest(input.mesh);
  const LobeTable lobes = make_lobe_table(1);
  const BakedScene& decoded = check.decoded;
  const std::optional<MirroredSky> sky = mirrored_sky(decoded);
  const std::uint64_t seed = mix64(check.seed ^ 0x6669656c64ULL);
  Eyes out;
  std::uint64_t item = 0;
  for (const SurfaceSample& s : sample_surface(mesh, kPoints, seed)) {
    Random random(seed, item++);
    const SurfaceMatch here{s.triangle, s.u, s.v, 0};
    const Vec3d normal = match_normal(mesh, here);
    const auto match = nearest.query(match_position(mesh, here), normal);
    if (!match) continue;
    const SurfacePoint at =
        surface_point(input, match->triangle, static_cast<float>(match->u), static_cast<float>(match->v));
    const Vec3d there = match_normal(input.mesh, *match), view = random_view(there, random);
    Vec3f face = at.geometric_normal;
    if (dot(face, to_float(there)) < 0) face = -face;
    const ReferencePoint place{at.position, to_float(there), face};
    if (hidden({place.position, place.normal, place.position, face})) continue;
    const EyeMaterial material = eye_material(input, at);
    const EyedPoint eyed{place, to_float(view), ggx_alpha(material.roughness), material.f0};
    const EyeMaterial shown = eye_material(
        decoded.scene, surface_point(decoded.scene, s.triangle, static_cast<float>(s.u), static_cast<float>(s.v)));
    out.shown.push_back(seen_radiance(decoded.field, sky ? &*sky : nullptr,
                                      {mesh.triangles[s.triangle], s.u, s.v, normal, view, shown.f0, shown.roughness}));
    out.truth.push_back(eyed);
    out.below.push_back(place);
    out.reflected.push_back(material.diffuse * (1 - lobe_at(lobes, dot(there, view), material.roughness).kept()));
    out.known.push_back(to_double(emission_at(input, at)) + punctual_highlights(check.truth, eyed));
  }
  return out;
}

}  // namespace

FieldCertificate certify_field(const FieldCheck& check, Threads& threads) {
  const auto start = std::chrono::steady_clock::now();
  const Eyes eyes = open_eyes(check);
  ReferenceLight light{.scene_lights = true};
  if (check.environment) light.environments.push_back(*check.environment);
  const std::size_t points = eyes.shown.size(), lightings = light.environments.size() + 1;

  FieldCertificate out;
  out.points = points;
  // Two paths of about twelve rays each: 5 % of the bake's.
  constexpr double kPathsOfRay = 0.05 / 24 / kPoints;
  out.samples = static_cast<int>(std::clamp(kPathsOfRay * static_cast<double>(check.bake_rays), 64.0, 1024.0));
  const ReferenceOptions paths{.samples = out.samples, .seed = mix64(check.seed ^ 0x65796573ULL)};
  const ReferenceOptions again{.samples = out.samples, .seed = mix64(paths.seed)};
  const ReferenceResult specular = trace_specular(check.truth, eyes.truth, light, paths, threads);
  const ReferenceResult diffuse = trace_reference(check.truth, eyes.below, light, again, threads);

  std::vector<Vec3d> truth(points), half_a(points), half_b(points);
  for (std::size_t i = 0; i < points; ++i) {
    truth[i] = half_a[i] = half_b[i] = eyes.known[i];
    for (std::size_t k = i; k < lightings * points; k += points) {
      truth[i] += eyes.reflected[i] * diffuse.value[k] + specular.value[k];
      half_a[i] += eyes.reflected[i] * diffuse.half_a[k] + specular.half_a[k];
      half_b[i] += eyes.reflected[i] * diffuse.half_b[k] + specular.half_b[k];
    }
  }
  const std::vector<Vec3d> noise = noise_from_halves(half_a, half_b);
  out.radiance = compute_error({eyes.shown, truth, noise, points}, {.seed = check.seed});
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return out;
}

}  // namespace kiln
