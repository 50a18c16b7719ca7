#pragma once
// What an eye sees of a light field on its surface: core/lightfield/seen.h with the materials that mirror and colour
// what the field keeps apart, and emit it.
//
// Keeps references. Images must have their pixels (decode_pixels).   Repeat  a pure function of its arguments

#include <optional>

#include "core/artifact/baked_scene.h"
#include "core/lightfield/seen.h"
#include "core/mesh/closest_point.h"

namespace kiln {

class FieldEye {
 public:
  FieldEye(const Scene&, const LightField&, const SkyLevels&);
  explicit FieldEye(const BakedScene& baked) : FieldEye(baked.scene, baked.field, baked.sky) {}

  /// `normal` and `view` are unit, the view points to the eye.
  Vec3d seen(const SurfaceMatch& place, const Vec3d& normal, const Vec3d& view) const;

 private:
  const Scene& scene_;
  const LightField& field_;
  std::optional<MirroredSky> sky_;
};

}  // namespace kiln
