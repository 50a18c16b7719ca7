#pragma once
// What a file stores of transfer vectors: `count` numbers for each vertex, four in a VEC4, normalised.
//   number[j] = offset[j] + scale[j] * stored[j],  stored in [-1, 1]                                     (1)
// raw          the numbers are the flat slots themselves, s = channel * slots + i.
// components   they are weights, and of a scene with lamps the lamps' slot of each channel after them:
//   slot[s] = mean[s] + sum_k number[k] * row_k[s],   lamps' slot of channel c = number[rank + c]        (2)
// Error of a number  after b-bit rounding at most scale[j] / (2^b - 1), and float rounding; one that is constant has
// scale 0 and is exact. What the last VEC4 holds past the last number means nothing.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/artifact/baked_scene.h"
#include "core/prt/components.h"
#include "core/prt/transfer.h"

namespace kiln {

/// The name of VEC4 k.
inline std::string stored_name(const Transfer& shape, std::size_t k) {
  return shape.order == 0 ? "_RADIOSITY" : "_PRT_" + std::to_string(k);
}
inline std::string field_name(std::size_t k) { return "_SLF_" + std::to_string(k); }
inline std::string sky_name(std::size_t k) { return "_SLF_SKY_" + std::to_string(k); }
inline std::string lamp_name(std::size_t k) { return "_SLF_LAMP_" + std::to_string(k); }
inline std::string glossy_name(std::size_t k) { return "_GLOSSY_" + std::to_string(k); }

inline std::size_t vec4s_of(std::size_t numbers) { return (numbers + 3) / 4; }

/// Equations 1 and 2: how a reader comes from stored numbers to slots.
struct StoredForm {
  std::vector<double> scale, offset;
  Components components;  // rank 0 without rows: raw

  bool raw() const { return components.rows.empty(); }
  std::size_t count() const { return scale.size(); }
  /// How many numbers transfer vectors of this shape have in this form.
  std::size_t expected_count(const Transfer& shape) const;
};

/// Writes the flat slots of one vertex from its numbers, `count` of them after equation 1.
void slots_of(const StoredForm&, const Transfer& shape, const float* numbers, float* slots);

/// Transfer vectors on their way into a file.
class StoredTransfer {
 public:
  /// Ranges are those of `vertices`, all that the file will hold. Expects finite coefficients.
  StoredTransfer(const Transfer&, const TransferEncoding&, std::span<const std::uint32_t> vertices);

  const StoredForm& form() const { return form_; }
  std::string name(std::size_t vec4) const { return stored_name(transfer_, vec4); }
  int bits(std::size_t vec4) const { return bits_[vec4]; }
  /// The normalised numbers 4k .. 4k+3 of the given vertices.
  std::vector<float> pack(std::size_t k, std::span<const std::uint32_t> vertices) const;
  /// The flat slots that a reader finds at a vertex: after rounding to the bits, or before.
  std::vector<float> read_back(std::size_t vertex, bool rounded) const;

 private:
  const float* numbers_of(std::size_t vertex) const;
  void measure_ranges(std::span<const std::uint32_t> vertices);
  void choose_bits(const TransferEncoding&);
  bool is_lamp(std::size_t number) const;

  const Transfer& transfer_;
  StoredForm form_;
  std::vector<float> weights_;  // of components, count() for each vertex; raw numbers are the coefficients
  std::vector<int> bits_;       // of each VEC4
};

/// Weights of matrices on their way into a file: stored like those of transfer vectors.
class StoredGlossy {
 public:
  /// `vertices` as above; those that have no matrix do not count, and at least one has.
  StoredGlossy(const GlossyTransfer&, const Encoding&, std::span<const std::uint32_t> vertices);

  std::size_t vec4s() const { return vec4s_of(glossy_.rank()); }
  const StoredForm& form() const { return numbers_->form(); }
  int bits(std::size_t vec4) const { return numbers_->bits(vec4); }
  bool has(std::uint32_t vertex) const { return glossy_.find(vertex) != GlossyTransfer::kNoMatrix; }
  /// The normalised numbers 4k .. 4k+3 of vertices that have matrices.
  std::vector<float> pack(std::size_t k, std::span<const std::uint32_t> vertices) const;

 private:
  std::vector<std::uint32_t> places(std::span<const std::uint32_t> vertices) const;

  const GlossyTransfer& glossy_;
  Transfer one_number_;  // stands for the matrices' vertices
  std::optional<StoredTransfer> numbers_;
};

/// r-RFs on their way into a file: stored like transfer vectors of three channels, what they see of the sky like such
/// of one, and what they see of lamps like such of order 0.
class StoredField {
 public:
  /// `vertices` as above.
  StoredField(const LightField&, const Encoding&, std::span<const std::uint32_t> vertices);

  const StoredTransfer& numbers() const { return *numbers_; }
  /// Null where no sky is kept apart.
  const StoredTransfer* visibility() const { return visibility_ ? &*visibility_ : nullptr; }
  /// Null where no lamp is kept apart.
  const StoredTransfer* lamps() const { return lamps_ ? &*lamps_ : nullptr; }

 private:
  Transfer shape_, visibility_shape_, lamp_shape_;
  std::optional<StoredTransfer> numbers_, visibility_, lamps_;
};

/// The shape under which r-RFs of a degree are stored.
inline Transfer field_shape(int degree) { return {degree + 1, 3, false, {}}; }
inline Transfer visibility_shape() { return {kVisibilityOrder, 1, false, {}}; }
/// A channel for each lamp.
inline Transfer lamp_shape(std::size_t lamps) { return {0, static_cast<int>(lamps), true, {}}; }

}  // namespace kiln
