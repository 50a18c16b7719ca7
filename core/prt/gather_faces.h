#pragma once
// What a gathering ray must know of the face it hits: which side counts, and how it reflects.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/base/vec.h"
#include "core/scene/scene.h"
#include "core/trace/tracer.h"

namespace kiln {

enum class HitSide { front, dark, flipped };

/// Four bytes a face. The side that a vertex's transfer stands for is that of its normal: for double-sided faces the
/// side of the vertex normals, for single-sided ones the side of the winding, whose back is dark.
/// Error   normals lie on an octahedral grid of 15 bits: within 0.006 degrees of grazing a side may be mistaken. (With
///         0.3 degrees a room of smooth walls lost 5e-4 of its light at each bounce.)
class GatherFaces {
 public:
  explicit GatherFaces(const Scene&);

  HitSide side(std::uint32_t triangle, const Vec3f& direction) const {
    const std::uint32_t face = faces_[triangle];
    if (dot(along_normal(face), direction) <= 0) return HitSide::front;
    return (face & kDoubleSided) != 0 ? HitSide::flipped : HitSide::dark;
  }
  /// Whether every point of the face's part has the same albedo: plain(part).
  bool is_plain(std::uint32_t triangle) const { return (faces_[triangle] & kPlain) != 0; }
  bool part_is_plain(std::uint32_t part) const { return plain_[part]; }
  Vec3f plain(std::uint32_t part) const { return albedo_[part]; }
  /// No albedo has a hue.
  bool grey() const { return grey_; }

  void prefetch(std::uint32_t triangle) const { __builtin_prefetch(&faces_[triangle]); }

 private:
  // A face: x and y of its normal on the octahedron |x| + |y| + |z| = 1, whose lower half is folded out; then flags.
  static constexpr std::uint32_t kDoubleSided = 1U << 30, kPlain = 1U << 31;
  static constexpr int kBits = 15, kSteps = (1 << kBits) - 2;  // even: 0 lies on the grid

  static std::uint32_t pack(const Vec3f& normal);
  /// The normal but for its length.
  static Vec3f along_normal(std::uint32_t face) {
    constexpr float kStep = 2.0F / kSteps;
    constexpr std::uint32_t kMask = (1U << kBits) - 1;
    const float x = kStep * static_cast<float>(static_cast<int>(face & kMask)) - 1;
    const float y = kStep * static_cast<float>(static_cast<int>(face >> kBits & kMask)) - 1;
    const float z = 1 - std::abs(x) - std::abs(y), folded = std::max(0.0F, -z);
    return {x - std::copysign(folded, x), y - std::copysign(folded, y), z};
  }

  std::vector<std::uint32_t> faces_;
  std::vector<bool> plain_;    // of each part
  std::vector<Vec3f> albedo_;  // of each part
  bool grey_ = true;
};

}  // namespace kiln
