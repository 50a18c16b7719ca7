#pragma once
// Checks that need more than one object: byte ranges of accessors, primitives, the node graph.

#include "core/artifact/findings.h"
#include "core/artifact/gltf_document.h"

namespace kiln::gltf {

inline constexpr int kMaxNodeDepth = 1024;

/// After this, reading any accessor of the document stays inside its views. Never recurses.
void check_document(const Document&, Findings&);

/// Bytes from one element to the next.
std::uint64_t stride_of(const Accessor&, const Document&);

}  // namespace kiln::gltf
