#pragma once
// report.json: what was planned, done, reached and what it cost. Fields are listed in core/bake/README.md.

#include <optional>
#include <string>

#include "core/artifact/streams.h"
#include "core/bake/bake_log.h"
#include "core/bake/certificate.h"
#include "core/bake/glossy_certificate.h"
#include "core/bake/grid_outcome.h"
#include "core/bake/light_field_stage.h"
#include "core/bake/lightmap_step.h"
#include "core/bake/links_step.h"
#include "core/bake/merge_step.h"
#include "core/bake/plan.h"
#include "core/bake/progressive.h"

namespace kiln {

/// What is known of the matrices, where there are any.
struct GlossyReport {
  int order = 0, channels = 1;
  std::size_t vertices = 0, rank = 0;
  double compression = 0, noise = 0;  // as GlossyBaked
  std::optional<GlossyCertificate> certificate;
};

/// The points of a radiosity bake, as delivered.
struct PointsOutcome {
  std::vector<std::uint32_t> levels;  // points up to the end of each
  std::uint64_t bytes = 0;            // in the file
};

/// Everything a report is made from.
struct ReportInput {
  const Scene& input;  // counts of the scene as it came
  std::uint64_t input_vertices = 0, input_triangles = 0;
  const Plan& plan;
  const Recipe& recipe;
  const BakeLog& log;
  const Mesh& result;  // as delivered
  std::uint64_t result_bytes = 0;
  const std::vector<StreamBytes>& streams;
  std::size_t rank = 0;  // of the stored components; 0: raw
  const std::optional<Certificate>& certificate;
  const std::optional<MergeOutcome>& merge;
  const std::optional<ErrorSources>& sources;
  const std::optional<GridOutcome>& grid;
  const std::optional<LinksOutcome>& links;
  const std::optional<LightmapOutcome>& lightmap;
  const std::optional<PointsOutcome>& points;
  const std::optional<FieldOutcome>& field;
  const std::optional<GlossyReport>& glossy;
  const std::optional<MeshlessOutcome>& meshless;
  const Passes& passes;  // none where a quality was asked for
};

std::string report_json(const ReportInput&);

/// The plan alone, for POST /v1/plan and `kiln plan`; with what is ahead of a promise where a trial told it.
std::string plan_report_json(const Plan&, const Scene&, const Promise&, const std::optional<Ahead>&);

}  // namespace kiln
