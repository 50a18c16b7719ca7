#include "core/bake/merge_step.h"

#include <algorithm>
#include <cmath>

#include "core/bake/direct_source.h"
#include "core/base/random.h"
#include "core/lightfield/simplify.h"
#include "core/mesh/closest_point.h"
#include "core/mesh/topology.h"
#include "core/prt/interreflection.h"
#include "core/trace/ggx.h"
#include "core/trace/tracer.h"

namespace kiln {
namespace {

constexpr double kFaint = 0.05;                 // of an open point, as in direct_source.cpp
constexpr float kUnit = 1 / kOpenConstantBand;  // coefficient of 1: products of degree 0 count Y_00^2

/// Light at the vertices by few rays.
Transfer draw_transfer(const Tracer& tracer, const Plan& plan, const TransferRays& rays, BakeLog& log,
                       Threads& threads) {
  const Mesh& mesh = tracer.scene().mesh;
  const std::vector<TransferPoint> points = vertex_points(mesh);
  const auto few = [](int samples) { return std::max(16, samples / kRoughRays); };
  TransferStats stats;
  std::vector<float> sky = bake_direct_transfer(tracer, points, rays.sky, threads, &stats);
  std::vector<Vec3f> lamps;
  if (plan.lamps) lamps = bake_fixed_direct(tracer, points, rays.lamps, threads, &stats);
  Transfer out = bake_interreflection(tracer, mesh, std::move(sky), std::move(lamps),
                                      {.order = plan.order,
                                       .bounces = std::min(plan.bounces, kMergeReflections),
                                       .samples = few(plan.bounce_samples),
                                       .seed = rays.sky.seed},
                                      threads, &stats);
  log.count_rays(stats.rays);
  return out;
}

/// Of one number of the transfer, over the surface and channels.
double mean_of(const Mesh& mesh, const Transfer& transfer, std::size_t slot) {
  double sum = 0, area = 0;
  for (const Triangle& t : mesh.triangles) {
    const double a = triangle_area(mesh, t);
    area += 3 * a;
    for (const std::uint32_t v : t)
      for (int c = 0; c < 3; ++c) sum += a * transfer.at(v, c)[slot] / 3;
  }
  return area > 0 ? sum / area : 0;
}

/// Factors of a vertex' numbers, so that squared differences are parts of squared mean light.
std::vector<float> scale_of(const Mesh& mesh, const Transfer& transfer, const std::vector<double>& band_power) {
  const double channels = std::sqrt(static_cast<double>(transfer.channels));
  const double sky = std::max(mean_of(mesh, transfer, 0), kFaint * kOpenConstantBand);
  std::vector<float> out;
  for (int l = 0; l < transfer.order; ++l) {
    const double band = std::sqrt(band_power[static_cast<std::size_t>(l)] / band_power[0]) / (sky * channels);
    out.insert(out.end(), static_cast<std::size_t>(2 * l + 1), static_cast<float>(band) * kUnit);
  }
  if (!transfer.fixed) return out;
  const double lamps = mean_of(mesh, transfer, out.size());
  out.push_back(lamps > 1e-30 && lamps < 1e30 ? static_cast<float>(1 / (lamps * channels)) * kUnit : 0);
  return out;
}

/// How much a texture changes from u = 0 to u = 1, over its mean: root mean square of steps between texels.
double detail_of(const Scene& scene, const TextureRef& ref) {
  constexpr double kUnknown = 50;  // twentieths of the mean between each of a thousand texels
  constexpr int kRows = 256;
  const int index = scene.textures[static_cast<std::size_t>(ref.texture)].image;
  if (index < 0) return 0;
  const Image& image = scene.images[static_cast<std::size_t>(index)];
  if (image.rgba.empty()) return kUnknown;
  const auto texel = [&](int x, int y) {
    return image.rgba.data() +
           4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(x));
  };
  double steps = 0, sum = 0, count = 0;
  for (int y = 0; y + 1 < image.height; y += 1 + image.height / kRows) {
    for (int x = 0; x + 1 < image.width; x += 1 + image.width / kRows) {
      for (int c = 0; c < 3; ++c) {
        const double here = texel(x, y)[c], right = texel(x + 1, y)[c] - here, below = texel(x, y + 1)[c] - here;
        steps += std::pow(right * image.width, 2) + std::pow(below * image.height, 2);
        sum += here;
        ++count;
      }
    }
  }
  const auto& m = ref.transform;
  const double stretch = std::max(std::hypot(m[0], m[3]), std::hypot(m[1], m[4]));
  return sum > 0 ? stretch * std::sqrt(steps / count) / (sum / count) : 0;
}

/// Of all textures that a set of texture coordinates places, the most.
float detail_of_set(const Scene& scene, int set) {
  double most = 0;
  for (const Material& m : scene.materials)
    for (const TextureRef* ref :
         {&m.base_color_texture, &m.metallic_roughness_texture, &m.emission_texture, &m.normal_texture})
      if (ref->texture >= 0 && ref->uv_set == set) most = std::max(most, detail_of(scene, *ref));
  return static_cast<float>(most);
}

/// A highlight as wide as the lobe is another one where the normal has turned by that. What matrices show may be four
/// times as wrong as other light (plan.cpp).
float sharpness_of(const Scene& scene, const Plan& plan) {
  if (!plan.glossy) return 0;
  float smoothest = 1;
  for (const PartFinish& part : find_specular_parts(scene, false)) smoothest = std::min(smoothest, part.smoothest);
  return static_cast<float>(1 / (4 * ggx_alpha(smoothest)));
}

/// What a vertex shows besides light, in the same unit.
class Looks {
 public:
  Looks(const Scene& scene, const Plan& plan)
      : mesh_(scene.mesh), sharpness_(sharpness_of(scene, plan) * kUnit), detail_{} {
    if (!mesh_.uv0.empty()) detail_[0] = detail_of_set(scene, 0) * kUnit;
    if (!mesh_.uv1.empty()) detail_[1] = detail_of_set(scene, 1) * kUnit;
    Vec4f sum;
    for (const Vec4f& c : mesh_.color) sum.x += c.x + c.y + c.z;
    if (sum.x > 0) color_ = kUnit * std::sqrt(3.0F) * static_cast<float>(mesh_.color.size()) / sum.x;
  }

  void append(std::size_t v, std::vector<float>& row) const {
    if (color_ > 0) {
      const Vec4f& c = mesh_.color[v];
      row.insert(row.end(), {color_ * c.x, color_ * c.y, color_ * c.z, kUnit * c.w});
    }
    if (detail_[0] > 0) row.insert(row.end(), {detail_[0] * mesh_.uv0[v].x, detail_[0] * mesh_.uv0[v].y});
    if (detail_[1] > 0) row.insert(row.end(), {detail_[1] * mesh_.uv1[v].x, detail_[1] * mesh_.uv1[v].y});
    if (sharpness_ > 0) {
      const Vec3f n = mesh_.normal[v] * sharpness_;
      row.insert(row.end(), {n.x, n.y, n.z});
    }
  }

 private:
  const Mesh& mesh_;
  float sharpness_, color_ = 0;
  std::array<float, 2> detail_;
};

/// Means of two draws, looks, and half differences of the draws.
LightField field_of(const Scene& scene, const Plan& plan, const std::array<Transfer, 2>& draw,
                    const std::vector<float>& scale) {
  const Looks looks(scene, plan);
  const std::size_t slots = scale.size(), width = draw[0].stride();
  LightField out{.degree = 0, .coefficients = {}};
  std::vector<float> row;
  for (std::size_t v = 0; v < scene.mesh.position.size(); ++v) {
    row.clear();
    for (std::size_t i = 0; i < width; ++i)
      row.push_back(0.5F * scale[i % slots] * (draw[0].at(v, 0)[i] + draw[1].at(v, 0)[i]));
    looks.append(v, row);
    for (std::size_t i = 0; i < width; ++i)
      row.push_back(0.5F * scale[i % slots] * (draw[0].at(v, 0)[i] - draw[1].at(v, 0)[i]));
    if (v == 0) out.coefficients.reserve(row.size() * scene.mesh.position.size());
    out.coefficients.insert(out.coefficients.end(), row.begin(), row.end());
  }
  out.channels = row.size(), out.noise = width;
  return out;
}

double diagonal_of(const Mesh& mesh) {
  Vec3f low = mesh.position[0], high = low;
  for (const Vec3f& p : mesh.position)
    for (std::size_t a = 0; a < 3; ++a) low[a] = std::min(low[a], p[a]), high[a] = std::max(high[a], p[a]);
  return length(high - low);
}

/// How far the vertices of `before` lie from `after`.
void measure_distance(const Mesh& before, const Mesh& after, MergeOutcome& out, Threads& threads) {
  const ClosestPoint nearest(after);
  std::vector<std::uint32_t> used;
  for (const Triangle& t : before.triangles) used.insert(used.end(), t.begin(), t.end());
  std::ranges::sort(used);
  used.erase(std::unique(used.begin(), used.end()), used.end());
  std::vector<double> distance(used.size());
  threads.for_blocks(distance.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto match = nearest.query(to_double(before.position[used[i]]), {});
      distance[i] = match ? match->distance : 0;
    }
  });
  double squares = 0;
  for (const double d : distance) squares += d * d, out.distance_max = std::max(out.distance_max, d);
  out.distance_rms = std::sqrt(squares / static_cast<double>(std::max<std::size_t>(distance.size(), 1)));
  const double unit = diagonal_of(before);
  if (unit > 0) out.distance_rms /= unit, out.distance_max /= unit;
}

void plan_splits(Plan& plan, std::uint64_t merged, std::uint64_t input) {
  if (plan.merge->added > 0) plan.subdivide.triangles = budget_after(*plan.merge, merged, input);
  plan.split = plan.split && plan.subdivide.triangles > merged;
}

}  // namespace

MergeOutcome merge_scene(Scene& scene, Plan& plan, const std::vector<double>& band_power, std::uint64_t seed,
                         BakeLog& log, Threads& threads) {
  MergeOutcome out{.input_triangles = scene.mesh.triangles.size(), .input_vertices = scene.mesh.position.size()};
  LitMesh lit{.mesh = scene.mesh, .field = {}};
  {
    const Tracer tracer(scene, threads);
    TransferRays rays = rough(transfer_rays(tracer, plan, band_power, seed, threads));
    std::array<Transfer, 2> draw;
    for (Transfer& one : draw) {
      rays.sky.seed = rays.lamps.seed = mix64(rays.sky.seed ^ 0x6d65726765ULL);
      one = draw_transfer(tracer, plan, rays, log, threads);
    }
    lit.field = field_of(scene, plan, draw, scale_of(scene.mesh, draw[0], band_power));
  }
  SimplifyResult merged =
      simplify(std::move(lit),
               {.max_error = plan.merge->max_error, .max_reach = plan.merge->max_reach, .mean_square = 1}, threads);
  measure_distance(scene.mesh, merged.lit.mesh, out, threads);
  scene.mesh = std::move(merged.lit.mesh);
  out.triangles = scene.mesh.triangles.size();
  out.vertices = scene.mesh.position.size();
  out.error = merged.error;
  plan_splits(plan, out.triangles, out.input_triangles);
  decide(plan, "merged", std::to_string(out.triangles) + " triangles",
         "of " + std::to_string(out.input_triangles) + "; it adds an estimated " + short_text(100 * out.error) +
             " % of error, and no vertex lies farther than " + short_text(100 * out.distance_max) +
             " % of the diagonal from the surface");
  return out;
}

}  // namespace kiln
