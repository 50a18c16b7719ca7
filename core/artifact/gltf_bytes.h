#pragma once
// The bytes behind buffers and buffer views. Nothing outside the upload is ever read.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/artifact/gltf_container.h"
#include "core/artifact/gltf_document.h"
#include "core/artifact/import.h"

namespace kiln::gltf {

using Span = std::span<const std::uint8_t>;

/// Owns what had to be decoded; everything else is a view into the upload, which must outlive it.
struct BufferBytes {
  std::vector<Bytes> owned;
  std::vector<Span> buffers;  // one for each buffer, exactly byteLength long; empty for meshopt fallbacks
  std::vector<Span> views;    // one for each buffer view; meshopt data decoded
};

/// Finds the bytes of a `data:` URI, or of a name among the resources of the upload.
/// Fails with external_uri_forbidden (any other scheme, absolute path, ".."), resource_missing or data_uri_invalid.
std::optional<Span> resolve_uri(const std::string& uri, const SceneFiles&, std::vector<Bytes>& owned,
                                const std::string& place, Findings&);

/// Resolves all buffers and views, ranges checked in 64 bits, compressed views decoded.
BufferBytes load_bytes(const Document&, const GltfContainer&, const SceneFiles&, const ImportLimits&, Findings&);

/// Decodes one EXT_meshopt_compression view. Fails with meshopt_invalid.
Bytes decode_meshopt(const Meshopt&, Span encoded, const std::string& place, Findings&);

}  // namespace kiln::gltf
