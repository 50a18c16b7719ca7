#pragma once
// What a Draco stream says about its size, read before the decoder allocates by it.

#include <cstdint>
#include <optional>
#include <span>

namespace kiln {

struct DracoHeader {
  std::uint64_t faces = 0;
  std::uint64_t vertices = 0;  // points (sequential) or connectivity vertices (edgebreaker, at most the points)
  bool sequential = false;
};

/// Bitstream 2.2 (what glTF asks for), triangular meshes only. Nothing if it is anything else or cut off.
std::optional<DracoHeader> read_draco_header(std::span<const std::uint8_t> stream);

}  // namespace kiln
