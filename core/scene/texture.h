#pragma once
// What a texture holds at a place.

#include "core/scene/scene.h"

namespace kiln {

/// Bilinear (or nearest) texel fetch with wrapping, as stored: sRGB decoded when `srgb`. White when the pixels are
/// absent.
Vec4f sample_texture(const Scene&, const TextureRef&, const Vec2f& uv, bool srgb);

}  // namespace kiln
