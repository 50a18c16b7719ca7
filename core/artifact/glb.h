#pragma once
// The GLB container: a JSON chunk and a binary chunk behind a 12-byte header (glTF 2.0, section 4.4).

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "core/artifact/import.h"
#include "core/base/result.h"

namespace kiln {

/// Joins the chunks, padded to 4 bytes. Fails when the file would pass 4 GiB, which the header cannot say.
Result<Bytes> join_glb(std::string json, Bytes binary);

struct GlbChunks {
  std::string_view json;
  std::span<const std::uint8_t> binary;
};

/// The chunks inside `file`, which must outlive them. Chunks of other types are skipped as the format asks.
Result<GlbChunks> split_glb(std::span<const std::uint8_t> file);

}  // namespace kiln
