#include "core/bake/light_field_certificate.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/bake/eye_material.h"
#include "core/bake/field_views.h"
#include "core/bake/second_look.h"
#include "core/bake/spending.h"
#include "core/base/random.h"
#include "core/prt/hidden.h"
#include "core/prt/lobe_table.h"
#include "core/trace/highlights.h"
#include "core/trace/reference.h"
#include "core/trace/surface.h"

namespace kiln {
namespace {

constexpr std::size_t kViews = 65536;  // that the file is asked for: half a second of one core

/// Eyes and what is known of the truth before a path is traced.
struct Eyes {
  std::vector<Vec3d> shown;
  std::vector<double> weight;
  std::vector<EyedPoint> truth;
  std::vector<Vec3d> reflected;  // by the diffuse layer towards the eye, of its light
  std::vector<Vec3d> known;      // emission and highlights of punctual lights

  std::size_t size() const { return shown.size(); }
  Eyes at(const std::vector<std::size_t>& chosen) const {
    Eyes out;
    for (const std::size_t i : chosen) {
      out.shown.push_back(shown[i]), out.weight.push_back(weight[i]), out.truth.push_back(truth[i]);
      out.reflected.push_back(reflected[i]), out.known.push_back(known[i]);
    }
    return out;
  }
};

struct Truth {
  std::vector<Vec3d> value, noise;
  std::uint64_t rays = 0;
};

class Judge {
 public:
  Judge(const FieldCheck& check, Threads& threads)
      : tracer_(check.truth), threads_(threads), hidden_(hidden_test(check.truth)) {
    light_.scene_lights = true;
    if (check.environment) light_.environments.push_back(*check.environment);
  }

  /// Those that are not inside solids.
  Eyes open(std::span<const FieldView> views) const {
    const Scene& input = tracer_.scene();
    Eyes out;
    for (const FieldView& v : views) {
      const SurfacePoint at =
          surface_point(input, v.truth.triangle, static_cast<float>(v.truth.u), static_cast<float>(v.truth.v));
      const Vec3f normal = to_float(v.normal);
      const Vec3f face = dot(at.geometric_normal, normal) < 0 ? -at.geometric_normal : at.geometric_normal;
      if (hidden_({at.position, normal, at.position, face})) continue;
      const EyeMaterial material = eye_material(input, at);
      const EyedPoint eyed{{at.position, normal, face}, to_float(v.view), ggx_alpha(material.roughness), material.f0};
      const double kept = lobe_at(albedo_table(), dot(v.normal, v.view), material.roughness).kept();
      out.shown.push_back(v.shown);
      out.weight.push_back(v.weight);
      out.truth.push_back(eyed);
      out.reflected.push_back(material.diffuse * (1 - kept));
      out.known.push_back(to_double(emission_at(input, at)) + punctual_highlights(tracer_, eyed));
    }
    return out;
  }

  /// By so many paths of each kind; metals have nothing diffuse.
  Truth trace(const Eyes& eyes, int samples, std::uint64_t seed) const {
    std::vector<ReferencePoint> below;
    std::vector<std::size_t> owner;
    for (std::size_t i = 0; i < eyes.size(); ++i) {
      if (eyes.reflected[i] == Vec3d{}) continue;
      below.push_back(eyes.truth[i].at);
      owner.push_back(i);
    }
    const ReferenceOptions paths{.samples = samples, .seed = seed}, again{.samples = samples, .seed = mix64(seed)};
    const ReferenceResult specular = trace_specular(tracer_, eyes.truth, light_, paths, threads_);
    const ReferenceResult diffuse = trace_reference(tracer_, below, light_, again, threads_);
    std::vector<Vec3d> half_a = eyes.known, half_b = eyes.known;
    const auto add = [](std::vector<Vec3d>& to, const std::vector<Vec3d>& from, auto&& place, auto&& share) {
      for (std::size_t k = 0; k < from.size(); ++k) to[place(k)] += share(k) * from[k];
    };
    const std::size_t points = std::max<std::size_t>(eyes.size(), 1), lit = std::max<std::size_t>(owner.size(), 1);
    const auto all = [&](std::size_t k) { return k % points; };
    const auto one = [](std::size_t) { return Vec3d{1, 1, 1}; };
    const auto of = [&](std::size_t k) { return owner[k % lit]; };
    const auto layer = [&](std::size_t k) { return eyes.reflected[owner[k % lit]]; };
    add(half_a, specular.half_a, all, one), add(half_b, specular.half_b, all, one);
    add(half_a, diffuse.half_a, of, layer), add(half_b, diffuse.half_b, of, layer);
    Truth out{{}, noise_from_halves(half_a, half_b), specular.rays + diffuse.rays};
    for (std::size_t i = 0; i < eyes.size(); ++i) out.value.push_back((half_a[i] + half_b[i]) * 0.5);
    return out;
  }

 private:
  const Tracer& tracer_;
  Threads& threads_;
  HiddenTest hidden_;
  ReferenceLight light_;
};

/// A path that finds an emitter by chance is an error of the reference that its own noise does not tell.
void look_again(Truth& all, const Judge& judge, const Eyes& eyes, int samples, std::uint64_t seed) {
  std::vector<double> doubt;
  for (std::size_t i = 0; i < eyes.size(); ++i) {
    const Vec3d d = eyes.shown[i] - all.value[i], &noise = all.noise[i];
    doubt.push_back(eyes.weight[i] * (dot(d, d) + noise.x + noise.y + noise.z));
  }
  const std::vector<std::size_t> doubtful = doubtful_points(doubt);
  const Truth known = judge.trace(eyes.at(doubtful), kMorePaths * samples, seed);
  for (std::size_t k = 0; k < doubtful.size(); ++k)
    all.value[doubtful[k]] = known.value[k], all.noise[doubtful[k]] = known.noise[k];
}

}  // namespace

FieldCertificate certify_field(const FieldCheck& check, Threads& threads) {
  const auto start = std::chrono::steady_clock::now();
  const std::uint64_t seed = mix64(check.seed ^ 0x6669656c64ULL), paths = mix64(check.seed ^ 0x65796573ULL);
  const Judge judge(check, threads);
  const std::vector<FieldView> views = even_views(check.decoded, check.truth.scene().mesh, kViews, seed, threads);

  const Eyes few = judge.open(choose_views(views, Spending::kFewestPoints, seed));
  const Truth first = judge.trace(few, Spending::kPilotSamples, mix64(paths));
  const ErrorStats known = compute_error({few.shown, first.value, first.noise, few.size(), few.weight},
                                         {.seed = check.seed, .resamples = 1});
  const double sent = static_cast<double>(std::max<std::size_t>(few.size(), 1)) * Spending::kPilotSamples;
  const Spending spending =
      plan_spending(known, std::max(1.0, static_cast<double>(first.rays) / sent), check.bake_rays, false);

  const Eyes eyes = judge.open(choose_views(views, spending.points, mix64(seed)));
  Truth truth = judge.trace(eyes, spending.samples, paths);
  look_again(truth, judge, eyes, spending.samples, mix64(paths ^ 0x616761696eULL));
  FieldCertificate out;
  out.points = eyes.size();
  out.samples = spending.samples;
  out.radiance = compute_error({eyes.shown, truth.value, truth.noise, eyes.size(), eyes.weight}, {.seed = check.seed});
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return out;
}

}  // namespace kiln
