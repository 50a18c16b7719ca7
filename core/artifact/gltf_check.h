#pragma once
// Checks that need more than one object: byte ranges of accessors, primitives, the node graph.

#include "core/artifact/findings.h"
#include "core/artifact/gltf_document.h"

namespace kiln::gltf {

inline constexpr int kMaxNodeDepth = 1024;

/// Whether every index is below the size of what it refers to, or -1 where it may be absent. check_tree says which one
/// is not, in the file; this is asked behind tinygltf, so that safety does not hang on what a library makes of numbers.
bool indices_hold(const Document&);

/// After this, reading any accessor of the document stays inside its views. Never recurses.
void check_document(const Document&, Findings&);

/// Bytes from one element to the next.
std::uint64_t stride_of(const Accessor&, const Document&);

}  // namespace kiln::gltf
