#pragma once
// The `transport` step: direct-to-indirect links for lights that move after the bake (core/meshless/link_builder.h),
// beside the scene itself, lit as by the step `radiosity`. The mesh is refined where the job's direct light changes,
// and where the reflected light of the links' probe lamps does. Result  scene.glb with KILN_meshless_light. What its
// certificate judges is that file, read back.

#include <optional>

#include "core/artifact/import.h"
#include "core/bake/bake_log.h"
#include "core/bake/links_certificate.h"
#include "core/bake/plan.h"
#include "core/bake/progressive.h"
#include "core/bake/radiosity_step.h"
#include "core/bake/recipe.h"
#include "core/meshless/link_builder.h"

namespace kiln {

/// The plan of `radiosity` with the links added: decisions, seconds, memory, bytes.
Plan make_links_plan(const Scene&, const Recipe&, const Environment* sky, Threads&);

/// Of a later pass: links of so many times the rays and points, and the light of the job with them.
void grow_links(Plan&, const RadiosityGrowth&, const Scene&);

struct LinksOutcome {
  LightLinks links;  // as delivered
  LinkStats stats;
  std::uint64_t bytes = 0;  // of the extension in the file
  std::optional<LinksCertificate> certificate;
};

/// Of a pass, for progressive.h: what the promise bounds is links.certificate.of_rms. `points` senders, `gathered`
/// receivers.
PassRecord links_record(const LinksOutcome&, const Plan&, const Mesh& delivered);

/// Builds before the mesh is refined, and finishes when it has been written.
class LinksStep {
 public:
  /// Keeps a copy of the scene as it is.
  LinksStep(const Scene&, Plan&, std::uint64_t seed, BakeLog&, Threads&);

  /// What the mesh is to be refined for (radiosity_step.h): mean light of each probe lamp, relative to its mean.
  std::size_t columns() const;
  std::vector<float> values(std::span<const TransferPoint>, Threads&) const;

  /// Adds the links to the file, whose vertices are those of `decoded`, reads them back and certifies them.
  Result<LinksOutcome> finish(Bytes& glb, const BakedScene& decoded, const Recipe&, Threads&);

 private:
  Plan& plan_;
  BakeLog& log_;
  std::uint64_t rays_before_;  // this pass
  Scene scene_;
  Tracer tracer_;
  LinkBuilder builder_;
};

}  // namespace kiln
