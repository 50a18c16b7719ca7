#pragma once
// Small baked scenes made in code, without a bake: known geometry, transfer by closed forms.

#include "core/artifact/baked_scene.h"

namespace kiln {

/// A tessellated sphere over a plane, lit by a soft sky: two parts, uv on the plane (with a checker texture), vertex
/// colours on the sphere. Transfer is the clamped cosine times a smooth guess of the occlusion; `order` 1..10.
BakedScene sphere_over_plane(int order, int channels, bool fixed);

/// Everything that the format can carry, on random geometry: two uv sets, tangents, vertex colours, textures with
/// transforms, every kind of light and material field.
BakedScene everything(int order, int channels);

/// Any scene as if nothing stood in the way of the sky: grey clamped-cosine transfer under a soft sky.
BakedScene open_sky(Scene, int order);

/// The scene's transfer vectors as weights of so many components.
TransferEncoding as_components(const BakedScene&, std::size_t rank);

/// One triangle in the plane y = 0 with the given normal at its corners; order and channels as asked, all slots zero.
BakedScene single_triangle(int order, int channels, bool fixed);

}  // namespace kiln
