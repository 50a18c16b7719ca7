#pragma once
// The `prt` step: direct transfer while the mesh is refined, then reflections between its surfaces.

#include <cstdint>
#include <optional>
#include <vector>

#include "core/bake/bake_log.h"
#include "core/bake/merge_step.h"
#include "core/bake/meshless_plan.h"
#include "core/bake/plan.h"
#include "core/base/threads.h"
#include "core/prt/direct_transfer.h"
#include "core/prt/glossy_bake.h"
#include "core/prt/transfer.h"
#include "core/scene/scene.h"
#include "core/trace/tracer.h"

namespace kiln {

/// Differences of transfer vectors at some vertices, spread evenly over the surface.
struct Probes {
  std::vector<std::uint32_t> vertices;
  std::vector<float> difference;  // [probe * 3 * slots + c * slots + i], always RGB
};

/// A second, independent draw of the same samples minus the first.
struct NoiseProbes {
  Probes direct, reflected;
};

inline constexpr std::size_t kNoiseProbes = 256;
/// So many vertices, in proportion to the area around them, and the places that vertices are lit at.
std::vector<std::uint32_t> choose_probes(const Mesh&, std::size_t count);
std::vector<TransferPoint> points_at(const Mesh&, const std::vector<std::uint32_t>& vertices);

struct Transport {
  std::optional<MergeOutcome> merge;  // as planned
  Transfer transfer;                  // of scene.mesh's vertices
  NoiseProbes noise;
  std::uint64_t bounce_rays = 0;
  GlossyBaked glossy;  // as planned
  std::optional<MeshlessOutcome> meshless;
};

/// The mesh that subdivision starts from. At most half of the new triangles go to lines where the light of `source`
/// jumps (core/prt/cut_lines.h); with `bounces` a quarter of the rest to the longest triangles, since reflected light
/// varies where direct light does not.
Mesh base_mesh(const Tracer&, const Plan&, const ValueSource& source, bool bounces, Threads&);

/// Refines scene.mesh as planned and solves for light at its vertices. What the measurements show to be needless is
/// skipped and added to plan.decisions with its reason.
/// `band_power` as in lightings.h: by it rays are spent.
Transport solve_transport(Scene& scene, Plan& plan, const std::vector<double>& band_power, std::uint64_t seed,
                          BakeLog& log, Threads& threads);

}  // namespace kiln
