#pragma once
// One whole bake of a scene as planned: light, file, certificate.

#include <optional>
#include <vector>

#include "core/artifact/baked_scene.h"
#include "core/artifact/carried_scene.h"
#include "core/artifact/streams.h"
#include "core/bake/bake.h"
#include "core/bake/bake_log.h"
#include "core/bake/plan.h"
#include "core/bake/progressive.h"
#include "core/bake/report.h"

namespace kiln {

/// An artefact and what is known of its error.
struct Pass {
  Plan plan;
  Bytes glb;
  std::vector<StreamBytes> streams;
  std::size_t rank = 0;  // of the stored components; 0: raw
  BakedScene decoded;
  std::uint64_t bounce_rays = 0, points = 0, gathered = 0;
  std::optional<MergeOutcome> merge;
  std::optional<Certificate> certificate;
  std::optional<ErrorSources> sources;
  std::optional<GridOutcome> grid;
  std::optional<LinksOutcome> links;
  std::optional<LightmapOutcome> lightmap;
  std::optional<PointsOutcome> point_field;
  std::optional<FieldOutcome> field;
  std::optional<GlossyReport> glossy;
  std::optional<MeshlessOutcome> meshless;
};

/// Leaves the surface that is the truth in `in.scene`: the refined one, or where vertices were merged that of the
/// input.
Result<Pass> bake_pass(const BakeInput&, CarriedScene& in, const std::optional<Environment>& light, Plan, BakeLog&,
                       Threads&);

/// `rays` of all kinds; `elapsed_s` of the bake when the pass ended.
PassRecord record_of(const Pass&, double seconds, std::uint64_t rays, double elapsed_s);

}  // namespace kiln
