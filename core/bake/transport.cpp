#include "core/bake/transport.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/bake/direct_source.h"
#include "core/bake/meshless_step.h"
#include "core/base/random.h"
#include "core/mesh/topology.h"
#include "core/prt/cut_lines.h"
#include "core/prt/direct_transfer.h"
#include "core/prt/interreflection.h"
#include "core/trace/surface_samples.h"
#include "core/trace/tracer.h"

namespace kiln {
namespace {

/// Reflected light varies where direct light does not (a ceiling above a lamp), and the split measure sees direct light
/// only. So a quarter of the new triangles first goes to the longest triangles: with positions as values, eq. 3 is a
/// triangle's perimeter.
Mesh split_longest(const Mesh& mesh, const Plan& plan, Threads& threads) {
  const std::uint64_t input = mesh.triangles.size();
  const std::uint64_t budget = input + (plan.subdivide.triangles - input) / 4;
  const double area_of_one = surface_area(mesh) / static_cast<double>(budget);
  const ValueSource positions{3, [](std::span<const TransferPoint> points) {
                                std::vector<float> values;
                                for (const TransferPoint& p : points)
                                  values.insert(values.end(), {p.position.x, p.position.y, p.position.z});
                                return values;
                              }};
  // Right triangles of legs sqrt(2 area) have a perimeter of 4.83 sqrt(area); 1.4 times it stops before the budget.
  const auto perimeter = static_cast<float>(1.4 * 4.83 * std::sqrt(area_of_one));
  return subdivide(mesh, positions, {.measure = SplitMeasure::eq3, .threshold = perimeter, .triangles = budget},
                   threads)
      .mesh;
}

/// The mesh to light and the joined columns of direct light at its vertices.
Subdivided bake_direct(const Tracer& tracer, const Plan& plan, DirectSource& source, Threads& threads) {
  if (!plan.split) return subdivide(tracer.scene().mesh, source.source(), {.triangles = 0}, threads);
  const ValueSource light = source.source();
  return subdivide(base_mesh(tracer, plan, light, plan.bounces > 0, threads), light, plan.subdivide, threads);
}

/// Direct light in two independent draws: the second minus the first, shaped as Probes.
std::vector<float> draw_twice(const Tracer& tracer, const std::vector<TransferPoint>& points, const Plan& plan,
                              const TransferRays& rays, Threads& threads) {
  const auto bands = static_cast<std::size_t>(sh_count(plan.order)), slots = bands + (plan.lamps ? 1 : 0);
  std::vector<float> out(points.size() * 3 * slots, 0.0F);
  for (const float sign : {-1.0F, 1.0F}) {
    const std::uint64_t draw = sign < 0 ? rays.sky.seed : mix64(rays.sky.seed ^ 0x6e6f697365ULL);
    TransferRays redrawn = rays;
    redrawn.sky.seed = redrawn.lamps.seed = draw;
    const std::vector<float> sky = bake_direct_transfer(tracer, points, redrawn.sky, threads);
    std::vector<Vec3f> lamps(points.size());
    if (plan.lamps) lamps = bake_fixed_direct(tracer, points, redrawn.lamps, threads);
    for (std::size_t p = 0; p < points.size(); ++p) {
      for (std::size_t c = 0; c < 3; ++c) {
        float* to = out.data() + (3 * p + c) * slots;
        for (std::size_t i = 0; i < bands; ++i) to[i] += sign * sky[p * bands + i];
        if (plan.lamps) to[bands] += sign * lamps[p][c];
      }
    }
  }
  return out;
}

bool emission_has_hue(const Scene& scene) {
  return std::ranges::any_of(scene.materials, [](const Material& m) {
    return m.emission != Vec3f{} &&
           (m.emission.x != m.emission.y || m.emission.y != m.emission.z || m.emission_texture.texture >= 0);
  });
}

/// Matrices of the parts that are to have them, from the finished transfer vectors.
GlossyBaked bake_matrices(const MeshlessWork& work, const Transfer& transfer, GlossyBake bake) {
  const auto& [tracer, plan, band_power, seed, log, threads, outcome] = work;
  const std::vector<std::uint32_t> vertices = vertices_of_parts(tracer.scene().mesh, plan.glossy.parts);
  if (!plan.glossy || vertices.empty()) return {};
  bake.matrix = {.order = plan.glossy.order,
                 .channels = transfer.channels == 3 || (plan.lamps && emission_has_hue(tracer.scene())) ? 3 : 1,
                 .fixed = transfer.fixed,
                 .reflected = plan.bounces > 0,
                 .samples = plan.glossy.samples,
                 .seed = seed};
  bake.rank.band_power.assign(band_power.begin(), band_power.begin() + plan.glossy.order);
  bake.rank.left_out = plan.glossy.compression / std::sqrt(2.0);  // the other half of the square is for rounding
  if (plan.meshless) return matrices_on_points(work, transfer, vertices, std::move(bake));
  return bake_glossy(tracer, transfer, vertices, bake, threads);
}

void skip_bounces_of_open_scene(Plan& plan, const DirectSource& source) {
  if (plan.bounces == 0 || plan.bounces_asked || source.stats().open_points < source.points()) return;
  plan.bounces = 0;
  for (Decision& d : plan.decisions) {
    if (d.decision == "bounces")
      d = {"bounces", "0", "no surface rises above any other: nothing can be lit indirectly"};
  }
}

/// Direct light at the vertices.
struct DirectAtVertices {
  std::vector<float> sky;
  std::vector<Vec3f> lamps;
  const std::vector<StandIn>& stand_ins;
  std::vector<std::uint32_t> probes;
};

constexpr std::size_t kPointProbes = 64;  // where light is read from points: each reads about ten

/// Adds reflected light, at the vertices or on points.
void reflect(const MeshlessWork& work, DirectAtVertices direct, Transport& out) {
  const Plan& plan = work.plan;
  ProbeNoise noise;
  if (plan.meshless && plan.bounces > 0) {
    direct.probes = choose_probes(work.tracer.scene().mesh, kPointProbes);
    SweptTransfer swept = sweep_on_points(work, direct.sky, direct.lamps, direct.stand_ins, direct.probes);
    out.transfer = std::move(swept.transfer);
    out.bounce_rays = swept.stats.gather_rays;
    noise = std::move(swept.noise);
  } else {
    TransferStats stats;
    out.transfer = bake_interreflection(
        work.tracer, work.tracer.scene().mesh, std::move(direct.sky), std::move(direct.lamps),
        {.order = plan.order,
         .bounces = plan.bounces,
         .samples = plan.bounce_samples,
         .seed = work.seed,
         .stand_ins = direct.stand_ins,
         .probes = direct.probes,
         .progress = [&log = work.log](std::uint64_t done, std::uint64_t all) { log.advance(done, all); }},
        work.threads, &stats, &noise);
    out.bounce_rays = stats.rays;
    work.log.count_rays(stats.rays);
  }
  if (plan.bounces > 0) out.noise.reflected = {std::move(direct.probes), std::move(noise.difference)};
}

}  // namespace

std::vector<std::uint32_t> choose_probes(const Mesh& mesh, std::size_t count) {
  std::vector<std::uint32_t> out;
  for (const SurfaceSample& s : sample_surface(mesh, count, 0x70726f6265ULL)) {
    const Triangle& t = mesh.triangles[s.triangle];
    out.push_back(s.u + s.v < 0.5F ? t[0] : s.u > s.v ? t[1] : t[2]);
  }
  return out;
}

std::vector<TransferPoint> points_at(const Mesh& mesh, const std::vector<std::uint32_t>& vertices) {
  const std::vector<std::uint32_t> face = widest_faces(mesh);
  std::vector<TransferPoint> out;
  for (const std::uint32_t v : vertices) out.push_back(vertex_point(mesh, v, face[v]));
  return out;
}

Mesh base_mesh(const Tracer& tracer, const Plan& plan, const ValueSource& source, bool bounces, Threads& threads) {
  const std::uint64_t input = tracer.scene().mesh.triangles.size(),
                      budget = input + (plan.subdivide.triangles - input) / 2;
  const Mesh cut = cut_where_light_jumps(tracer, source, budget, threads);
  return bounces ? split_longest(cut, plan, threads) : cut;
}

Transport solve_transport(Scene& scene, Plan& plan, const std::vector<double>& band_power, std::uint64_t seed,
                          BakeLog& log, Threads& threads) {
  std::vector<float> sky;
  std::vector<Vec3f> lamps;
  std::vector<StandIn> stand_ins;
  std::vector<std::uint32_t> probes;
  Transport out;
  if (plan.merge) {
    log.begin("merge", 0.2);
    out.merge = merge_scene(scene, plan, band_power, seed, log, threads);
  }
  log.begin("transfer", 0.55);
  Mesh refined = [&] {
    const Tracer tracer(scene, threads);
    const TransferRays rays = transfer_rays(tracer, plan, band_power, seed, threads);
    DirectSource source(tracer, plan, rays, band_power, log, threads);
    Subdivided direct = bake_direct(tracer, plan, source, threads);
    source.separate(direct.values, sky, lamps);
    stand_ins = std::move(direct.stand_ins);
    log.count_rays(source.stats().rays);
    skip_bounces_of_open_scene(plan, source);
    probes = choose_probes(direct.mesh, kNoiseProbes);
    out.noise.direct = {probes, draw_twice(tracer, points_at(direct.mesh, probes), plan, rays, threads)};
    return std::move(direct.mesh);
  }();
  scene.mesh = std::move(refined);

  log.begin("bounces", 0.85);
  const Tracer tracer(scene, threads);
  MeshlessOutcome points;
  const MeshlessWork work{tracer, plan, band_power, seed, log, threads, points};
  reflect(work, {std::move(sky), std::move(lamps), stand_ins, std::move(probes)}, out);
  if (plan.glossy) {
    log.begin("glossy", 0.88);
    GlossyBake bake{.stand_ins = std::move(stand_ins),
                    .progress = [&log](std::uint64_t done, std::uint64_t all) { log.advance(done, all); }};
    out.glossy = bake_matrices(work, out.transfer, std::move(bake));
    log.count_rays(out.glossy.rays);
  }
  if (plan.meshless) out.meshless = std::move(points);
  return out;
}

}  // namespace kiln
