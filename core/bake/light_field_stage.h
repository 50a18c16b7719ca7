#pragma once
// What becomes of a light field, baked or carried by the input: levels of detail, files, certificates.
// The delivered scene is simplified (light_field_levels.h); truth stays that of the surface as it was baked.

#include <optional>
#include <string>
#include <vector>

#include "core/artifact/baked_scene.h"
#include "core/bake/bake_log.h"
#include "core/bake/level_switch.h"
#include "core/bake/light_field_certificate.h"
#include "core/bake/light_field_levels.h"
#include "core/bake/plan.h"
#include "core/bake/progressive.h"
#include "core/bake/recipe.h"
#include "core/lightfield/outgoing.h"

namespace kiln {

struct FieldLevelReport {
  std::string file;
  std::size_t triangles = 0, vertices = 0;
  std::uint64_t bytes = 0;
  double estimate = 0;  // as FieldLevel
  bool reached = true;
  std::optional<LevelSwitch> follows;  // how large it may be where it takes the place of the level before
  std::optional<FieldCertificate> certificate;
};

struct FieldOutcome {
  bool carried = false;  // by the input
  int degree = 0, rays = 0;
  double noise = 0;                   // as OutgoingLight
  double storage = 0, last_band = 0;  // relRMSE: what storage may add; radiance in the last band
  std::optional<ErrorStats> baked;    // before simplification, where a promise asks for it
  double search_seconds = 0;          // of that and of what a target allows
  std::size_t rank = 0, baked_triangles = 0, baked_vertices = 0;
  std::uint64_t progressive_bytes = 0;   // of KILN_progressive_mesh, 0 where it was not asked for
  std::vector<FieldLevelReport> levels;  // scene.glb, then lod1.glb and on
  std::vector<Bytes> lods;               // the files of the latter
};

/// What a loop of passes needs to know of one; rays and times are left to the bake.
PassRecord field_record(const FieldOutcome&);

class LightFieldStage {
 public:
  struct Job {
    const std::optional<Environment>& environment;
    const Recipe& recipe;
    const LightField* carried = nullptr;  // by the input: then this is the truth
  };
  /// Puts the first level into `baked`.
  LightFieldStage(BakedScene& baked, OutgoingLight, Plan&, const Job&, BakeLog&, Threads&);

  /// Of the first level (choose_field_encoding).
  const TransferEncoding& encoding() const { return encoding_; }
  /// The scene as it was baked; once.
  Scene take_surface() { return std::move(surface_); }

  /// Adds the progressive mesh to the file whose vertices are those of `decoded`, writes the other levels and certifies
  /// them all. `surface`: what take_surface gave.
  Result<FieldOutcome> finish(Bytes& glb, const BakedScene& decoded, const Scene& surface, Threads&);

 private:
  FieldCertificate certify(const BakedScene& shown, const Scene& surface, const Tracer*, Threads&) const;
  FieldLevels simplified(const BakedScene&, LightField, BakeLog&, Threads&);

  Plan& plan_;
  Job job_;
  std::uint64_t rays_ = 0;  // of the field: of a pass alone, so that one that goes on after others is judged as it was
  Scene surface_;
  FieldLevels levels_;
  TransferEncoding encoding_;
  Bytes progressive_;  // KILN_progressive_mesh, if asked
  FieldOutcome outcome_;
};

}  // namespace kiln
