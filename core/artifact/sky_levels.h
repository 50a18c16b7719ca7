#pragma once
// The blurred skies of a light field (core/lightfield/mirrored_sky.h) as bytes: a word for each texel, level by level.
//   colour = unit * 2^(exponent - 24) * mantissa,  5 bits of exponent over 9 of blue, of green, of red (1)
// Source  the shared exponent format of OpenGL (EXT_texture_shared_exponent, RGB9_E5).
// Error   2^-9 of a texel's brightest channel: half a step of the largest mantissas

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/result.h"
#include "core/lightfield/mirrored_sky.h"

namespace kiln {

struct PackedSky {
  std::vector<int> heights;  // of each level; twice as wide
  double unit = 1;           // a power of two
  std::vector<std::uint32_t> texels;
};

PackedSky pack_sky(const SkyLevels&);
/// Expects as many texels as the heights say.
SkyLevels unpack_sky(const PackedSky&);

}  // namespace kiln
