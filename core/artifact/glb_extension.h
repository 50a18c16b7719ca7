#pragma once
// A root extension that a bake added to a finished scene.glb (links_glb.h, progressive_glb.h), on its way back in.

#include <cstdint>
#include <functional>
#include <span>

#include "core/artifact/findings.h"
#include "core/artifact/gltf_bytes.h"
#include "core/artifact/json_fields.h"

namespace kiln {

/// Calls read(extension, buffer views) where the file's root has the extension, and does nothing where it has not.
/// Fails as read_baked_glb does on a file that is damaged; then `read` is not called.
using ReadExtension = std::function<void(const Fields& extension, const gltf::BufferBytes& bytes)>;
void read_root_extension(std::span<const std::uint8_t> glb, const char* name, Findings&, const ReadExtension& read);

}  // namespace kiln
