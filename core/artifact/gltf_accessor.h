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

/// One element at a time, for readers that never hold a whole accessor. Sparse accessors and those without a view are
/// held after all: they are small, or refused.
class AccessorReader {
 public:
  /// Fails as read_floats where the elements have to be held.
  AccessorReader(const AccessorSource&, int accessor, const std::string& place, Findings&);

  std::uint64_t count() const { return count_; }
  std::uint64_t width() const { return width_; }
  /// `width()` numbers; they may be not finite.
  void floats(std::uint64_t element, float* out) const;
  /// Of an unsigned scalar accessor.
  std::uint32_t index(std::uint64_t element) const;
  /// Where the element lies in memory; nothing if it is held.
  const std::uint8_t* address(std::uint64_t element) const;

 private:
  const std::uint8_t* base_ = nullptr;
  std::uint64_t stride_ = 0, count_ = 0, width_ = 1;
  Component component_ = Component::f32;
  bool normalized_ = false;
  std::vector<float> held_;
  std::vector<std::uint32_t> held_indices_;
};

}  // namespace kiln::gltf
