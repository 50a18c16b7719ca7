#pragma once
// The images of a glTF: every header checked, pixels decoded where the bake needs them.

#include "core/artifact/gltf_bytes.h"

namespace kiln::gltf {

/// One Image for each of the document, with its encoded bytes. Pixels only for base colour and emission textures of
/// `materials`. Sizes are checked before decoding, one image at a time.
/// Fails with image_type, image_invalid, image_too_large, resource_missing, external_uri_forbidden.
std::vector<Image> load_images(const Document&, const BufferBytes&, const SceneFiles&, const ImportLimits&, Findings&);

}  // namespace kiln::gltf
