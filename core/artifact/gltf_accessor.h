#pragma once
// Accessor elements as floats or indices, whatever their form in the file.

#include <optional>
#include <vector>

#include "core/artifact/gltf_bytes.h"

namespace kiln::gltf {

/// Where accessors are read from. Valid only after load_bytes and check_document.
struct AccessorSource {
  const Document& document;
  const BufferBytes& bytes;
};

/// Width floats for each element; normalised integers as floats, sparse values put in.
/// Fails with non_finite_geometry (names the element) and accessor_sparse_index.
std::vector<float> read_floats(const AccessorSource&, int accessor, const std::string& place, Findings&);

/// Elements of an unsigned scalar accessor.
std::vector<std::uint32_t> read_indices(const AccessorSource&, int accessor, const std::string& place, Findings&);

}  // namespace kiln::gltf
