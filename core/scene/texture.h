#pragma once
// What a texture holds at a place.

#include "core/scene/scene.h"

namespace kiln {

/// Bilinear (or nearest) texel fetch with wrapping, as stored: sRGB decoded when `srgb`. White when the pixels are
/// absent.
Vec4f sample_texture(const Scene&, const TextureRef&, const Vec2f& uv, bool srgb);

/// A channel of an 8-bit texel, sRGB decoded (IEC 61966-2-1): [0, 1].
float linear_of_srgb(std::uint8_t);

}  // namespace kiln
