#include "core/bake/meshless_step.h"

#include <algorithm>
#include <chrono>

#include "core/bake/direct_source.h"

namespace kiln {
namespace {

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

}  // namespace

void StageClock::begin(std::string_view stage) {
  end();
  const auto found = std::ranges::find(seconds_, stage, &std::pair<std::string, double>::first);
  running_ = 1 + static_cast<std::size_t>(found - seconds_.begin());
  if (found == seconds_.end()) seconds_.emplace_back(stage, 0.0);
  since_ = now();
}

void StageClock::end() {
  if (running_ > 0) seconds_[running_ - 1].second += now() - since_;
  running_ = 0;
}

SweptTransfer sweep_on_points(const MeshlessWork& work, const std::vector<float>& sky, const std::vector<Vec3f>& lamps,
                              const std::vector<StandIn>& stand_ins, const std::vector<std::uint32_t>& probes) {
  constexpr std::uint64_t kStages = 5;
  const Plan& plan = work.plan;
  TransferRays rays = rough(transfer_rays(work.tracer, plan, work.band_power, work.seed, work.threads));
  rays.sky.band_power.assign(work.band_power.begin(), work.band_power.end());
  const auto vertices = static_cast<double>(work.tracer.scene().mesh.position.size());
  StageClock& clock = work.outcome.sweep_clock;
  TransferSweeps params{.bounces = plan.bounces,
                        .points = sweep_points(*plan.meshless, work.tracer.scene(), vertices),
                        .sky = rays.sky,
                        .lamps = rays.lamps,
                        .rays = plan.bounce_samples,
                        .eps = plan.meshless->eps,
                        .seed = work.seed,
                        .stand_ins = stand_ins,
                        .probes = probes,
                        .stage = [&, done = std::uint64_t{0}](std::string_view stage) mutable {
                          clock.begin(stage);
                          work.log.advance(done++, kStages);
                        }};
  params.points.seed = work.seed;
  SweptTransfer out = sweep_transfer(work.tracer, sky, lamps, params, work.threads);
  clock.end();
  work.outcome.sweeps = out.stats;
  work.log.count_rays(out.stats.direct_rays + out.stats.gather_rays);
  return out;
}

GlossyBaked matrices_on_points(const MeshlessWork& work, const Transfer& light, std::span<const std::uint32_t> vertices,
                               GlossyBake bake) {
  StageClock& clock = work.outcome.matrix_clock;
  GlossyPoints params{.bake = std::move(bake),
                      .points = matrix_points(*work.plan.meshless, work.tracer.scene(), work.plan.glossy.parts,
                                              static_cast<double>(vertices.size())),
                      .eps = work.plan.meshless->eps_transfer,
                      .stage = [&](std::string_view stage) { clock.begin(stage); }};
  params.points.seed = work.seed;
  GlossyPointStats stats;
  GlossyBaked out = bake_glossy_on_points(work.tracer, light, vertices, params, work.threads, stats);
  clock.end();
  work.outcome.matrices = stats;
  work.outcome.matrix_vertices = vertices.size();
  work.outcome.matrix_rays = out.rays;
  return out;
}

}  // namespace kiln
