#include "core/lightfield/outgoing.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>

#include "core/base/expects.h"
#include "core/lightfield/field_lamp.h"
#include "core/lightfield/hemisphere_norm.h"
#include "core/lightfield/lobe_fits.h"
#include "core/lightfield/mirrored_sky.h"
#include "core/lightfield/visibility_fit.h"
#include "core/mesh/topology.h"
#include "core/prt/direction_sets.h"
#include "core/prt/ray_origin.h"
#include "core/prt/transfer_point.h"
#include "core/trace/ggx.h"
#include "core/trace/lights.h"
#include "core/trace/surface.h"

namespace kiln {
namespace {

constexpr int kSets = 8, kBatch = 4;
constexpr std::size_t kBlock = 64;
constexpr double kEven = 0.5 / std::numbers::pi;  // density of a vertex' rays
constexpr double kWhite = 3.5449077018110318;     // 2 sqrt(pi): coefficient of a constant 1

/// What a vertex is made of.
struct VertexMaterial {
  Vec3f f0, below, emission;
  double roughness = 1;
};

VertexMaterial material_at(const Scene& scene, std::uint32_t vertex, std::uint32_t face) {
  if (face == kNoFace) return {};
  const Triangle& t = scene.mesh.triangles[face];
  const SurfacePoint p = surface_point(scene, face, t[1] == vertex ? 1.0F : 0.0F, t[2] == vertex ? 1.0F : 0.0F);
  const SurfaceFinish finish = finish_at(scene, p);
  const Vec3d color = to_double(albedo_at(scene, p));
  return {to_float(specular_f0(color, finish.metallic)), to_float(diffuse_color(color, finish.metallic)),
          emission_at(scene, p), finish.roughness};
}

RoughnessRange roughness_of(const Scene& scene, std::span<const std::uint32_t> faces) {
  RoughnessRange out{1, 0};
  for (std::uint32_t v = 0; v < faces.size(); ++v) {
    const double roughness = material_at(scene, v, faces[v]).roughness;
    out = {std::min(out.least, roughness), std::max(out.most, roughness)};
  }
  return faces.empty() ? RoughnessRange{} : out;
}

constexpr float kTurnedAway = -1;  // what a vertex sees of a lamp behind its horizon, until that is known
constexpr std::size_t kNoLamp = static_cast<std::size_t>(-1);

/// What a vertex sees in one direction.
struct Look {
  Vec3f w, light;
  Vec3f sky;        // the part of the light that is the sky's, or would be if nothing were in the way
  float place = 0;  // which half of its set it belongs to, as IncidentLight::Visit says
  bool even = false, open = false, lamp = false;
  std::size_t punctual = kNoLamp;  // the number of a punctual lamp
};

SkyVisibility visibility_of(std::span<const Look> looks, double share) {
  VisibilityFit fit;
  for (const Look& look : looks)
    if (!look.lamp) fit.add(look.w, look.even, double{look.sky.x} + double{look.sky.y} + double{look.sky.z}, look.open);
  SkyVisibility out = fit.fit();
  for (float& c : out) c *= static_cast<float>(share);
  return out;
}

/// Numbers of the lamps that are brightest at the points, in the mean square; in the order of the scene.
std::vector<std::size_t> brightest_lamps(const std::vector<Light>& lights, std::span<const TransferPoint> points) {
  std::vector<double> squares;
  for (const Light& light : lights) {
    double sum = 0;
    for (const TransferPoint& p : points) {
      const Vec3d e = light_arrival(light, to_double(p.position)).irradiance;
      sum += dot(e, e);
    }
    squares.push_back(sum);
  }
  std::vector<std::size_t> out(lights.size());
  std::iota(out.begin(), out.end(), std::size_t{0});
  std::ranges::stable_sort(out, std::greater{}, [&](std::size_t k) { return squares[k]; });
  out.resize(std::min(out.size(), kMostFieldLamps));
  std::ranges::sort(out);
  return out;
}

/// The two halves of a vertex' rays, without what the visible sky adds: their mean is the result, their difference the
/// noise.
struct Halves {
  std::array<LobeSum, 2> sums;

  void add(std::span<const Look> looks, const SkyVisibility* visibility, const Basis<float>& local) {
    for (const Look& look : looks) {
      Vec3f light = look.light;
      if (visibility && !look.lamp)
        light = light - look.sky * static_cast<float>(visibility_along(*visibility, to_double(look.w)));
      if (light == Vec3f{}) continue;
      const Vec3f l = local.to_local(look.w);
      if (look.place < 0)
        for (LobeSum& half : sums) half.add(l, light * 0.5F);
      else
        sums[look.place < 0.5F ? 0 : 1].add(l, light);
    }
  }
};

class Gather {
 public:
  Gather(const IncidentLight::World& world, const OutgoingBake& params)
      : seed_(mix64(params.seed ^ 0x6f7574676f696eULL)),
        sets_(0, 2 * half_of(params.rays), kSets, seed_, half_of(params.rays), Spread::half_sphere),
        light_(world, {.count = sets_.samples(), .density = kEven, .direct = true, .blurred = true}, seed_) {}

  /// All that a vertex sees, for one sum over the half space.
  std::vector<Look> looks(const TransferPoint& point, std::uint64_t& rays) const {
    const Vec3f origin = ray_origin(point);
    const std::uint64_t item = point_key(point);
    const LocalFrame frame = local_frame(sets_, point.normal, seed_, item);
    Random random(seed_, item, 2);
    const int batches = sets_.samples() / (kBatch * kPacket);
    const float weight = static_cast<float>(1 / (kEven * sets_.samples()));
    std::vector<Look> out;
    out.reserve(3 * static_cast<std::size_t>(sets_.samples()));
    for (int k = 0; k < batches; ++k) {
      trace(origin, frame, k, [&](const Vec3f& w, const Hit& hit) {
        const IncidentLight::Seen seen = light_.along(w, hit, random, rays);
        out.push_back({.w = w,
                       .light = seen.light * weight,
                       .sky = light_.sky_along(w) * weight,
                       .place = k < batches / 2 ? 0 : 0.75F,
                       .even = true,
                       .open = seen.met == IncidentLight::Met::sky});
      });
    }
    rays += static_cast<std::uint64_t>(sets_.samples());
    light_.visit_bright_sky(origin, item, rays, [&](const Vec3f& w, const Vec3f& light, float place, bool open) {
      out.push_back({.w = w, .light = open ? light : Vec3f{}, .sky = light, .place = place, .open = open});
    });
    light_.visit_punctual(origin, rays, [&](std::size_t lamp, const Vec3f& w, const Vec3f& light) {
      out.push_back({.w = w, .light = light, .place = -1, .lamp = true, .punctual = lamp});
    });
    light_.visit_emitters(origin, item, rays, [&](const Vec3f& w, const Vec3f& light, float place) {
      out.push_back({.w = w, .light = light, .place = place, .lamp = true});
    });
    return out;
  }

 private:
  /// Each half of the rays is a stratified set of whole batches.
  static int half_of(int rays) { return (rays + 2 * kBatch * kPacket - 1) / (2 * kBatch * kPacket) * kBatch * kPacket; }

  template <class Look>
  void trace(const Vec3f& origin, const LocalFrame& frame, int batch, const Look& look) const {
    const IncidentLight::World& world = light_.world();
    std::array<Rays16, kBatch> rays;
    std::array<Hits16, kBatch> hits;
    for (std::size_t k = 0; k < kBatch; ++k) {
      rays[k].ox.fill(origin.x), rays[k].oy.fill(origin.y), rays[k].oz.fill(origin.z), rays[k].far.fill(kFar);
      sets_.turn(frame.set, batch * kBatch + static_cast<int>(k), frame.basis, rays[k]);
      world.tracer.closest16(rays[k], hits[k]);
      for (const std::uint32_t triangle : hits[k].triangle) {
        if (triangle != kNoHit && world.surface != nullptr) world.surface->prefetch(triangle);
      }
    }
    for (std::size_t k = 0; k < kBatch; ++k) {
      for (std::size_t i = 0; i < kPacket; ++i)
        look(Vec3f{rays[k].dx[i], rays[k].dy[i], rays[k].dz[i]},
             Hit{hits[k].t[i], hits[k].u[i], hits[k].v[i], hits[k].triangle[i], false});
    }
  }

  std::uint64_t seed_;
  DirectionSets sets_;
  IncidentLight light_;
};

/// What a vertex keeps apart.
struct SharpVertex {
  double share = 0, alpha = 1;  // of the sky
  Vec3f f0;
};

struct VertexResult {
  double noise = 0, mean = 0;  // mean square over eyes and channels; radiance
  SharpVertex sharp;
  Vec3f below;  // of its material
};

/// Fits what each vertex sends.
class VertexBake {
 public:
  struct Surface {
    const Scene& scene;
    std::span<const std::uint32_t> faces;  // of vertices
    std::span<const std::size_t> lamps;    // that are kept apart
  };
  VertexBake(const IncidentLight::World& world, const OutgoingBake& params, const Surface& surface, Threads& threads)
      : world_(world),
        scene_(surface.scene),
        lamps_(surface.lamps),
        apart_(params.sky_apart && world.sky != nullptr),
        fits_(params.degree, threads, roughness_of(scene_, surface.faces)),
        norm_(params.degree),
        gather_(world, params) {
    if (apart_) sky_level_ = project_environment(*world.sky, 1)[0] / static_cast<float>(kWhite);
  }

  bool sky_apart() const { return apart_; }

  /// Writes the vertex' part of the field; its `face` says what it is made of. Adds to `rays`.
  VertexResult bake(std::uint32_t v, std::uint32_t face, const TransferPoint& point, const Vec3f& value,
                    LightField& out, std::uint64_t& rays) const {
    const VertexMaterial material = material_at(scene_, v, face);
    const LobeFit fit = fits_.at(material.roughness);
    std::vector<Look> looks = gather_.looks(point, rays);
    const double apart = apart_ ? share_apart(material.roughness) : 0;
    VertexResult result;
    result.sharp.f0 = material.f0;
    result.below = material.below;
    result.mean += take_lamps(looks, material);
    for (std::size_t k = 0; k < lamps_.size(); ++k)
      out.lamp_visibility[lamps_.size() * v + k] = share_seen(scene_.lights[lamps_[k]], point, rays);
    SkyVisibility visibility{};
    if (apart > 0) {
      visibility = visibility_of(looks, apart);
      std::ranges::copy(visibility, &out.visibility[kVisibilityCount * v]);
      result.sharp = {apart, ggx_alpha(material.roughness), material.f0};
    }
    Halves halves{{LobeSum(fit), LobeSum(fit)}};
    halves.add(looks, apart > 0 ? &visibility : nullptr, basis_around(point.normal));
    const std::span<float> all = out.of(v);
    const Vec3f sent = material.below * value;
    result.noise = mix_halves(halves, material, out.has_diffuse() ? Vec3f{} : sent, all);
    if (out.has_diffuse()) result.mean += double{sent.x + sent.y + sent.z} / 3;
    for (std::size_t c = 0; c < 3; ++c) {
      float* series = &all[c * out.count()];
      rotate_sh(fits_.degree() + 1, basis_around(point.normal), series, series);
      if (!out.emission_apart) series[0] += material.emission[c] * static_cast<float>(kWhite);
      const double mirrored = double{visibility[0]} * double{material.f0[c] * sky_level_[c]};
      result.mean += (double{series[0]} + mirrored) / (kWhite * 3);
      if (out.emission_apart) result.mean += double{material.emission[c]} / 3;
    }
    return result;
  }

 private:
  /// Takes the lamps that are kept apart out of the looks. Returns the mean of their highlights over eyes and channels.
  double take_lamps(std::vector<Look>& looks, const VertexMaterial& material) const {
    double mean = 0;
    std::erase_if(looks, [&](const Look& look) {
      if (std::ranges::find(lamps_, look.punctual) == lamps_.end()) return false;
      // A lobe sends F0 E in all; a half space has 2 pi.
      mean += double{dot(material.f0, look.light)} / (3 * 2 * std::numbers::pi);
      return true;
    });
    return mean;
  }

  /// Of a lamp, whatever its cone and range, which are those of the place that an eye sees. kTurnedAway: what is in
  /// the way is the surface itself.
  float share_seen(const Light& light, const TransferPoint& point, std::uint64_t& rays) const {
    const Vec3f origin = ray_origin(point);
    const LightArrival arrival = light_arrival(light, to_double(origin));
    if (!(dot(arrival.direction, to_double(point.normal)) > 0)) return kTurnedAway;
    ++rays;
    const float far = std::isfinite(arrival.distance) ? static_cast<float>(arrival.distance) : kFar;
    return world_.tracer.occluded(origin, to_float(arrival.direction), far) ? 0.0F : 1.0F;
  }

  /// The mean of both halves, each of which stands for half of the light; returns the noise of it.
  double mix_halves(const Halves& halves, const VertexMaterial& material, const Vec3f& below,
                    std::span<float> all) const {
    std::vector<float> half(all.size());
    halves.sums[0].finish(material.f0, below, 2, all);
    halves.sums[1].finish(material.f0, below, 2, half);
    std::vector<double> off(all.size());
    for (std::size_t k = 0; k < all.size(); ++k) {
      off[k] = 0.5 * (double{all[k]} - double{half[k]});
      all[k] = 0.5F * (all[k] + half[k]);
    }
    return squared_norm(norm_, {0, 0, 1}, off) / 3;
  }

  const IncidentLight::World& world_;
  const Scene& scene_;  // that sends
  std::span<const std::size_t> lamps_;
  bool apart_;
  LobeFits fits_;
  HemisphereNorm norm_;
  Gather gather_;
  Vec3f sky_level_;
};

/// By the area around each vertex.
double noise_of(const Mesh& mesh, std::span<const VertexResult> vertices) {
  double squares = 0, sum = 0, all = 0;
  for (const Triangle& t : mesh.triangles) {
    const double area = triangle_area(mesh, t);
    for (const std::uint32_t v : t) squares += area * vertices[v].noise, sum += area * vertices[v].mean, all += area;
  }
  return sum > 0 ? std::sqrt(squares / all) / (sum / all) : 0;
}

/// The blurred skies that those vertices need, and what distances need to know of them.
void add_sky(const Environment& sky, std::span<const VertexResult> vertices, OutgoingLight& out, Threads& threads) {
  constexpr std::size_t kSlopeLevel = 2;  // alpha .5
  constexpr double kTurn = 0.3;           // of the mirror direction, where vertices are few
  double least = 1, all = 0, squared_f0 = 0;
  Vec3d f0;
  for (const VertexResult& vertex : vertices) {
    const SharpVertex& v = vertex.sharp;
    if (!(v.share > 0)) continue;
    least = std::min(least, v.alpha);
    f0 += to_double(v.f0) * v.share;
    squared_f0 += double{dot(v.f0, v.f0)} / 3 * v.share;
    all += v.share;
  }
  if (!(all > 0)) {
    out.field.visibility.clear();
    return;
  }
  out.sky = blur_sky(sky, least / 2, threads);
  // Surfaces that are smoother than this find less: what is finer is off by all it has, and not by its slope.
  const Environment& level = out.sky[std::min<std::size_t>(out.sky.size() - 1, kSlopeLevel)];
  Vec3d squares;
  for (const Vec3f& c : level.radiance) squares += to_double(c) * to_double(c);
  squares = squares / static_cast<double>(level.radiance.size());
  out.field.sky = to_float(f0 / all * Vec3d{std::sqrt(squares.x), std::sqrt(squares.y), std::sqrt(squares.z)});
  // The mirror direction turns by 2 in the plane of the eye and 2 cos across it: 8/3 in the mean square over eyes.
  out.field.sky_slope = static_cast<float>(8.0 / 3 * squared_f0 / all * mean_square_slope(level, kTurn));
}

/// Where a triangle ends that faces a lamp, a vertex may be turned away from it: what such vertices see is what their
/// neighbours do, and nothing where no neighbour faces the lamp.
void go_on_behind_the_edge(const Mesh& mesh, std::size_t lamps, std::vector<float>& seen) {
  std::vector<float> sum(seen.size()), all(seen.size());
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t k = 0; k < lamps; ++k) {
      for (const std::uint32_t from : t) {
        const float there = seen[lamps * from + k];
        if (there == kTurnedAway) continue;
        for (const std::uint32_t to : t) sum[lamps * to + k] += there, all[lamps * to + k] += 1;
      }
    }
  }
  for (std::size_t i = 0; i < seen.size(); ++i)
    if (seen[i] == kTurnedAway) seen[i] = all[i] > 0 ? sum[i] / all[i] : 0;
}

/// The lamps and what distances need to know of them.
void add_lamps(const std::vector<Light>& lights, std::span<const std::size_t> lamps,
               std::span<const TransferPoint> points, std::span<const VertexResult> vertices, LightField& out) {
  for (std::size_t k = 0; k < lamps.size(); ++k) {
    const Light& light = lights[lamps[k]];
    Vec3d squares;
    double all = 0;
    for (std::size_t v = 0; v < points.size(); ++v) {
      const double seen = out.lamp_visibility[lamps.size() * v + k];
      if (!(seen > 0)) continue;
      const Vec3d sent =
          light_arrival(light, to_double(points[v].position)).irradiance * to_double(vertices[v].sharp.f0);
      squares += sent * sent * seen;
      all += seen;
    }
    if (all > 0) squares = squares / all;
    out.lamps.push_back(
        make_field_lamp(light, to_float({std::sqrt(squares.x), std::sqrt(squares.y), std::sqrt(squares.z)})));
  }
}

/// Root mean square over vertices.
Vec3f diffuse_color_of(std::span<const VertexResult> vertices) {
  Vec3d squares;
  for (const VertexResult& v : vertices) squares += to_double(v.below) * to_double(v.below);
  squares = squares / static_cast<double>(std::max<std::size_t>(1, vertices.size()));
  return to_float({std::sqrt(squares.x), std::sqrt(squares.y), std::sqrt(squares.z)});
}

}  // namespace

double share_apart(double roughness) { return std::clamp((0.65 - roughness) / 0.2, 0.0, 1.0); }

OutgoingLight bake_outgoing(const IncidentLight::World& world, const LitVertices& vertices, const OutgoingBake& params,
                            Threads& threads) {
  const Scene& scene = vertices.scene;
  const std::span<const Vec3f> value = vertices.value;
  EXPECTS(value.size() == scene.mesh.position.size());
  EXPECTS(params.degree >= 0 && params.degree <= kMaxLightFieldDegree && params.rays >= 1);
  const std::vector<std::uint32_t> faces = widest_faces(scene.mesh);
  const std::vector<TransferPoint> points = vertex_points(scene.mesh);
  std::vector<std::size_t> lamps;
  if (params.lamps_apart) lamps = brightest_lamps(scene.lights, points);
  const VertexBake vertex(world, params, {scene, faces, lamps}, threads);
  const std::vector<std::uint32_t> order = morton_order_of(points);
  OutgoingLight out;
  out.field.degree = params.degree;
  out.field.emission_apart = params.emission_apart;
  out.field.coefficients.resize(3 * out.field.count() * points.size());
  if (vertex.sky_apart()) out.field.visibility.resize(kVisibilityCount * points.size());
  out.field.lamp_visibility.resize(lamps.size() * points.size());
  if (params.diffuse_apart) {
    for (const Vec3f& light : value) out.field.diffuse.insert(out.field.diffuse.end(), {light.x, light.y, light.z});
  }
  std::vector<VertexResult> results(points.size());
  std::atomic<std::uint64_t> rays = 0, done = 0;
  threads.for_blocks(points.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    std::uint64_t own = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t v = order[i];
      results[v] = vertex.bake(v, faces[v], points[v], value[v], out.field, own);
    }
    rays += own;
    done += end - begin;
    if (params.progress) params.progress(done, points.size());
  });
  out.rays = rays;
  out.noise = noise_of(scene.mesh, results);
  if (vertex.sky_apart()) add_sky(*world.sky, results, out, threads);
  go_on_behind_the_edge(scene.mesh, lamps.size(), out.field.lamp_visibility);
  add_lamps(scene.lights, lamps, points, results, out.field);
  if (params.diffuse_apart) out.field.diffuse_color = diffuse_color_of(results);
  return out;
}

}  // namespace kiln
