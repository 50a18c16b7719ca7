#pragma once
// A lightmap as files: an image in scene.glb that readers of MOZ_lightmap show, and lightmap.exr, which loses nothing.
// README.md specifies both.
//   value = irradiance / pi at a texel; files hold irradiance, W m^-2
// Image    8 bits of each channel, linear: irradiance = intensity * byte / 255. The intensity is the one with the least
//          squared error of rounding and of cutting off what is brighter.
// EXR      32-bit floats

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/artifact/import.h"
#include "core/base/result.h"

namespace kiln {

struct Lightmap {
  int side = 0;               // 0: there is none
  std::vector<Vec3f> texels;  // value, row by row from the top
  std::vector<char> parts;    // of the scene: whether the lightmap shows it

  /// Bilinear, the border repeated outwards.
  Vec3f at(const Vec2f& uv) const;
};

/// The file with one scene more, "lightmap", whose materials carry MOZ_lightmap over TEXCOORD_1. `glb` was written by
/// write_baked_glb; parts without a triangle are not in it.
Result<Bytes> add_lightmap(std::span<const std::uint8_t> glb, const Lightmap&, std::span<const char> written_parts);

/// As a viewer decodes it; side 0 where the file has none. Parts are the file's.
/// Fails with unsupported_version, image_invalid, number_out_of_range, or as read_baked_glb does.
Result<Lightmap> read_lightmap(std::span<const std::uint8_t> glb);

/// `provenance` is JSON.
Bytes write_lightmap_exr(const Lightmap&, const std::string& provenance);

/// The texels alone, of any square picture. Fails with exr_unsupported, exr_invalid, image_too_large, lightmap_invalid
Result<Lightmap> read_lightmap_exr(std::span<const std::uint8_t> file, const std::string& name);

}  // namespace kiln
