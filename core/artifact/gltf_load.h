#pragma once
// JSON text to a gltf::Document, through tinygltf.

#include <cstdint>
#include <span>

#include "core/artifact/findings.h"
#include "core/artifact/gltf_document.h"

namespace kiln::gltf {

/// Reads text that has passed scan_json. Fails on wrong types, indices out of range, unknown enums, another version
/// than 2.x and required extensions that Kiln does not know. Warns of used ones that it ignores.
Document load_document(std::span<const std::uint8_t> json, Findings&);

}  // namespace kiln::gltf
