#include "core/bake/transport.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/mesh/topology.h"
#include "core/prt/direct_transfer.h"
#include "core/prt/interreflection.h"
#include "core/trace/tracer.h"

namespace kiln {
namespace {

/// Direct light of both kinds at points. Lamps ride ahead as four more columns (RGB and nothing: a four of their own in
/// row_store.h), scaled so that a typical lamp value weighs as much in the split measure as the constant band of an
/// open point.
class DirectSource {
 public:
  DirectSource(const Tracer& tracer, const Plan& plan, std::uint64_t seed, BakeLog& log, Threads& threads)
      : tracer_(tracer),
        log_(log),
        sky_(tracer, {.order = plan.order, .samples = plan.samples, .seed = seed}),
        plan_(plan),
        seed_(seed),
        threads_(threads),
        lamp_scale_(plan.lamps ? measure_lamp_scale() : 1) {}

  std::size_t lamp_columns() const { return plan_.lamps ? 4 : 0; }
  std::size_t bands() const { return static_cast<std::size_t>(sh_count(plan_.order)); }
  std::size_t width() const { return lamp_columns() + bands(); }

  /// Lamp light and the constant band stay within what was sampled: no vertex is darker than black.
  ValueSource source() {
    ValueSource s{
        .width = width(), .values = std::ref(*this), .bounded = {lamp_columns()}, .hidden = hidden_test(tracer_)};
    if (plan_.lamps) s.bounded.insert(s.bounded.end(), {0, 1, 2});
    return s;
  }

  std::vector<float> operator()(std::span<const TransferPoint> batch) {
    points += batch.size();
    log_.advance(std::min(points, expected_points()), expected_points());
    std::vector<float> sky = sky_.bake(batch, threads_, &stats);
    if (!plan_.lamps) return sky;
    const std::vector<Vec3f> lamps =
        bake_fixed_direct(tracer_, batch, {.samples = plan_.lamp_samples, .seed = seed_}, threads_, &stats);
    return join(sky, lamps);
  }

  /// Takes the joined columns apart again.
  void separate(const std::vector<float>& joined, std::vector<float>& sky, std::vector<Vec3f>& lamps) const {
    const std::size_t points = joined.size() / width();
    sky.resize(points * bands());
    lamps.resize(plan_.lamps ? points : 0);
    for (std::size_t p = 0; p < points; ++p) {
      const float* row = joined.data() + p * width();
      std::copy_n(row + lamp_columns(), bands(), sky.data() + p * bands());
      if (plan_.lamps) lamps[p] = Vec3f{row[0], row[1], row[2]} / lamp_scale_;
    }
  }

  TransferStats stats;
  std::uint64_t points = 0;  // asked for so far

 private:
  static constexpr float kOpenConstantBand = 0.2820948F;  // t_0 of an unoccluded point: Y(0,0)

  /// From about a thousand vertices spread over the input, whatever batches will be asked for.
  float measure_lamp_scale() {
    const std::vector<TransferPoint> all = vertex_points(tracer_.scene().mesh);
    std::vector<TransferPoint> some;
    for (std::size_t i = 0; i < all.size(); i += 1 + all.size() / 1024) some.push_back(all[i]);
    double sum = 0;
    for (const Vec3f& x : bake_fixed_direct(tracer_, some, {.samples = plan_.lamp_samples, .seed = seed_}, threads_))
      sum += x.x + x.y + x.z;
    const double mean = some.empty() ? 0 : sum / (3.0 * static_cast<double>(some.size()));
    return mean > 1e-30 && mean < 1e30 ? static_cast<float>(kOpenConstantBand / mean) : 1.0F;
  }

  std::vector<float> join(const std::vector<float>& sky, const std::vector<Vec3f>& lamps) const {
    std::vector<float> joined(lamps.size() * width(), 0.0F);
    for (std::size_t p = 0; p < lamps.size(); ++p) {
      float* row = joined.data() + p * width();
      for (std::size_t c = 0; c < 3; ++c) row[c] = lamps[p][c] * lamp_scale_;
      std::copy_n(sky.data() + p * bands(), bands(), row + lamp_columns());
    }
    return joined;
  }

  /// Subdivision asks for three points a final triangle, unless its threshold ends it early.
  std::uint64_t expected_points() const {
    return plan_.split ? 3 * plan_.subdivide.triangles : tracer_.scene().mesh.position.size();
  }

  const Tracer& tracer_;
  BakeLog& log_;
  DirectTransferBaker sky_;
  const Plan& plan_;
  std::uint64_t seed_;
  Threads& threads_;
  float lamp_scale_;
};

/// Reflected light varies where direct light does not (a ceiling above a lamp), and the split measure sees direct light
/// only. So a quarter of the new triangles first goes to the longest triangles: with positions as values, eq. 3 is a
/// triangle's perimeter.
Mesh refine_base(const Mesh& mesh, const Plan& plan, Threads& threads) {
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
Subdivided bake_direct(const Mesh& mesh, const Plan& plan, DirectSource& source, Threads& threads) {
  if (!plan.split) return subdivide(mesh, source.source(), {.triangles = 0}, threads);
  const Mesh base = plan.bounces > 0 ? refine_base(mesh, plan, threads) : mesh;
  return subdivide(base, source.source(), plan.subdivide, threads);
}

void skip_bounces_of_open_scene(Plan& plan, const DirectSource& source) {
  if (plan.bounces == 0 || source.stats.open_points < source.points) return;
  plan.bounces = 0;
  for (Decision& d : plan.decisions) {
    if (d.decision == "bounces")
      d = {"bounces", "0", "no surface rises above any other: nothing can be lit indirectly"};
  }
}

}  // namespace

Transfer solve_transport(Scene& scene, Plan& plan, std::uint64_t seed, BakeLog& log, Threads& threads) {
  std::vector<float> sky;
  std::vector<Vec3f> lamps;
  log.begin("transfer", 0.55);
  std::vector<StandIn> stand_ins;
  Mesh refined = [&] {
    const Tracer tracer(scene, threads);
    DirectSource source(tracer, plan, seed, log, threads);
    Subdivided direct = bake_direct(scene.mesh, plan, source, threads);
    source.separate(direct.values, sky, lamps);
    stand_ins = std::move(direct.stand_ins);
    log.count_rays(source.stats.rays);
    skip_bounces_of_open_scene(plan, source);
    return std::move(direct.mesh);
  }();
  scene.mesh = std::move(refined);

  log.begin("bounces", 0.85);
  const Tracer tracer(scene, threads);
  TransferStats stats;
  Transfer transfer =
      bake_interreflection(tracer, scene.mesh, std::move(sky), std::move(lamps),
                           {.order = plan.order,
                            .bounces = plan.bounces,
                            .samples = plan.bounce_samples,
                            .seed = seed,
                            .stand_ins = std::move(stand_ins),
                            .progress = [&log](std::uint64_t done, std::uint64_t all) { log.advance(done, all); }},
                           threads, &stats);
  log.count_rays(stats.rays);
  return transfer;
}

}  // namespace kiln
