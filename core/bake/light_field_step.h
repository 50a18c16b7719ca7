#pragma once
// The `lightfield` step: radiance that leaves the surface towards every eye (core/lightfield), under the job's light.
// The scene is lit as by the step `radiosity`, its mesh refined where direct light, colour or finish change; then what
// arrives at each vertex is gathered and fitted.   Result  a LightField beside the transfer of order 0.

#include <array>
#include <span>
#include <vector>

#include "core/artifact/baked_scene.h"
#include "core/bake/bake_log.h"
#include "core/bake/plan.h"
#include "core/bake/recipe.h"
#include "core/lightfield/outgoing.h"
#include "core/mesh/closest_point.h"
#include "core/prt/transfer_point.h"

namespace kiln {

/// The plan of `radiosity` with the light field added: decisions, seconds, memory, bytes.
Plan make_light_field_plan(const Scene&, const Recipe&, const Environment* sky, Threads&);

/// Parts of such a plan that do not ask where the light comes from: simplification, levels, storage; and what is added
/// to a prediction for the field of its vertices.
void decide_simplification(Plan&, const Recipe&);
void add_field_prediction(Plan&);
/// Of a later pass, which bakes so many times the triangles; degree and rays are the plan's.
void predict_grown_field(Plan&, double triangles);

/// What the mesh is refined for besides light: colour, emission and finish of the surface.
class FinishSource {
 public:
  /// Keeps a copy of the scene as it is.
  explicit FinishSource(const Scene&);
  static constexpr std::size_t kWidth = 8;  // colour, emission, metallic, roughness; 1 in the mean
  std::vector<float> values(std::span<const TransferPoint>, Threads&) const;

 private:
  Scene scene_;
  ClosestPoint nearest_;
  bool glow_apart_, diffuse_apart_;  // emission, colours of the diffuse layer are no reason to split
  std::array<float, kWidth> scale_{};
};

OutgoingLight bake_light_field(const IncidentLight::World&, const LitVertices&, const Plan&, BakeLog&, Threads&);

/// How r-RFs are stored: as weights of as few components and in as few bits as the plan's share for storage allows.
TransferEncoding choose_field_encoding(const LightField&, const Mesh&, const Plan&);

}  // namespace kiln
