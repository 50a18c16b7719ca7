#pragma once
// scene.glb: the result of a bake, written and read. core/artifact/README.md specifies every byte.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/artifact/evaluate.h"
#include "core/artifact/import.h"
#include "core/artifact/lightmap_file.h"
#include "core/base/result.h"
#include "core/lightfield/mirrored_sky.h"
#include "core/prt/components.h"
#include "core/prt/glossy_transfer.h"
#include "core/prt/lobe_table.h"
#include "core/prt/transfer.h"
#include "core/scene/environment.h"
#include "core/scene/scene.h"

namespace kiln {

/// The light a bake was asked for: what stock viewers see, and what `eval` without --env uses.
struct BakedLight {
  std::string name;
  std::vector<Vec3f> coefficients = {};  // sh_count(order) RGB; empty when no environment was given
  std::vector<Vec3f> bright = {};  // as many: of these the part of bright_part.h; empty where nothing is so bright

  LightParts parts() const { return {coefficients, bright}; }
};

/// An environment as a bake of this order has it.
BakedLight baked_light(const Environment&, int order);

struct BakedScene {
  Scene scene;            // final geometry and the original materials, textures and lights
  Transfer transfer;      // of scene.mesh's vertices
  GlossyTransfer glossy;  // of whole parts: all of a part's vertices have matrices, or none
  LobeTable lobes;        // of glossy.order, where there are matrices
  LightField field;       // of scene.mesh's vertices, or of none
  SkyLevels sky;          // where the field keeps it apart
  Lightmap lightmap;      // to be shown in place of the vertices' light; not written by write_baked_glb
  BakedLight light;
  float exposure = 1;      // COLOR_0 = tone map of exposure * radiance
  std::string provenance;  // a JSON object for asset.extras.kiln; "{}" if none
};

/// How transfer vectors are stored (stored_transfer.h): raw, or as weights of components.
struct TransferEncoding {
  int bits = 12;               // of a number over its own range
  Components components;       // none: raw
  std::vector<float> weights;  // of the components, rank for each vertex
  double weight_step = 0;      // weights are rounded to steps of at most this; 0: to `bits`
  double lamp_step = 0;        // the light of lamps likewise: near a lamp it may be a thousand times its mean
};

struct Encoding {
  int position_bits = 20;  // over the unit cube, one grid for all primitives (no cracks)
  int normal_bits = 12;
  int texcoord_bits = 14;
  int lightmap_bits = 14;  // of TEXCOORD_1
  TransferEncoding transfer;
  TransferEncoding field;  // of r-RFs, as if they were transfer vectors
  int visibility_bits = 10;
  bool glossy = true;      // false leaves the matrices out (to measure sizes)
  double glossy_step = 0;  // weights of matrices are rounded to steps of at most this; 0: to transfer.bits
  int speed = 7;           // Draco 0 (small) .. 10 (fast); 7 is as small as 5 and writes twice as fast (measured)
};

/// The bytes of a GLB. Draco reorders vertices: what read_baked_glb gives back is the delivered order.
Result<Bytes> write_baked_glb(const BakedScene&, const Encoding& = {});

/// Reads what write_baked_glb wrote, exactly as a viewer decodes it. Validates every index and range.
/// Images come encoded; decode_pixels fills in their pixels.
/// Fails with not_a_baked_scene, unsupported_version, slot_count_mismatch, attribute_missing, draco_damaged,
/// accessor_count_mismatch, or as import_scene does.
Result<BakedScene> read_baked_glb(std::span<const std::uint8_t> file, const std::string& name = "scene.glb");

/// Decodes the images that base colour, emission and metallic-roughness textures name. One that cannot be decoded keeps
/// empty pixels.
void decode_pixels(Scene&);

}  // namespace kiln
