#pragma once
// The outer shell of a glTF file: JSON text and, in a GLB, the binary chunk.

#include <cstdint>
#include <span>

#include "core/artifact/findings.h"

namespace kiln {

struct GltfContainer {
  std::span<const std::uint8_t> json;
  std::span<const std::uint8_t> binary;
  bool has_binary = false;
};

bool looks_like_glb(std::span<const std::uint8_t> file);
bool looks_like_json(std::span<const std::uint8_t> file);

/// GLB: header, exactly one JSON chunk first, at most one BIN chunk second, unknown chunks ignored, lengths exact.
GltfContainer open_glb(std::span<const std::uint8_t> file, Findings&);
/// Plain JSON; a byte-order mark is skipped with a warning.
GltfContainer open_gltf(std::span<const std::uint8_t> file, Findings&);

}  // namespace kiln
