#pragma once
// KILN_meshless_light: direct-to-indirect links in a scene.glb. core/artifact/README.md specifies every byte.
// Beside the baked scene: a reader that does not know the extension shows the file as before.

#include <span>

#include "core/artifact/baked_scene.h"
#include "core/base/result.h"
#include "core/meshless/light_links.h"

namespace kiln {

/// The file with links. `links` are for the vertices of read_baked_glb(glb), in their order. Fails as join_glb does.
Result<Bytes> add_links(std::span<const std::uint8_t> glb, const LightLinks& links);

/// The links of a file, every count, index and number checked; without vertices where the file has none. `baked` is
/// what read_baked_glb made of it. Fails with json_type, unsupported_version, slot_count_mismatch, index_out_of_range,
/// number_out_of_range, or as read_baked_glb does.
Result<LightLinks> read_links(std::span<const std::uint8_t> glb, const BakedScene& baked);

}  // namespace kiln
