#pragma once
// KILN_progressive_mesh in a scene.glb: {"version": 2, "bufferView": n}, whose bytes core/lightfield/README.md
// specifies. Beside the baked scene: a reader that does not know the extension shows the file as before.

#include <span>

#include "core/artifact/import.h"
#include "core/base/result.h"
#include "core/lightfield/progressive_mesh.h"

namespace kiln {

/// The file with the bytes of encode_progressive(). Fails as join_glb does.
Result<Bytes> add_progressive(std::span<const std::uint8_t> glb, std::span<const std::uint8_t> bytes);

/// What a file has of it: without triangles where it has none. Fails with unsupported_version, index_out_of_range, or
/// as decode_progressive and read_baked_glb do.
Result<ProgressiveMesh> read_progressive(std::span<const std::uint8_t> glb);

}  // namespace kiln
