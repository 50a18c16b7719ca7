#pragma once
// A scene that brings its light along: what the step `lightfield` simplifies without tracing a ray (carried.md).
// Two sources: the attributes _RF_n under KILN_radiance_functions, and scene.glb with KILN_light_field.

#include "core/artifact/import.h"
#include "core/base/result.h"
#include "core/lightfield/light_field.h"
#include "core/prt/transfer.h"
#include "core/scene/scene.h"

namespace kiln {

struct CarriedScene {
  Scene scene;
  LightField field;  // of scene.mesh's vertices; without coefficients where the file carries no light
  Transfer diffuse;  // of order 0, beside a field: what viewers show that know one colour a vertex

  bool carries_light() const { return !field.coefficients.empty(); }
};

/// Reads as import_scene does. Of radiance functions it keeps shape and light alone: their colours are in them, so
/// materials become white and textures go. A scene.glb has all that it had.
/// Fails as import_scene, read_baked_glb, and with the codes of carried.md.
Result<CarriedScene> import_carried_scene(const SceneFiles&, const ImportLimits& = {});

}  // namespace kiln
