#pragma once
// What a gathering ray must know of the face it hits: which side counts, and how it reflects.

#include <cstdint>
#include <vector>

#include "core/base/vec.h"
#include "core/scene/scene.h"
#include "core/trace/tracer.h"

namespace kiln {

enum class HitSide { front, dark, flipped };

/// Four bytes a face. The side that a vertex's transfer stands for is that of its normal: for double-sided faces the
/// side of the vertex normals, for single-sided ones the side of the winding, whose back is dark.
/// Error   normals have 8 bits: within 0.3 degrees of grazing a side may be mistaken
class GatherFaces {
 public:
  explicit GatherFaces(const Scene&);

  HitSide side(std::uint32_t triangle, const Vec3f& direction) const {
    const Face& f = faces_[triangle];
    const float away = static_cast<float>(f.x) * direction.x + static_cast<float>(f.y) * direction.y +
                       static_cast<float>(f.z) * direction.z;
    if (away <= 0) return HitSide::front;
    return (f.flags & kDoubleSided) != 0 ? HitSide::flipped : HitSide::dark;
  }
  /// Whether every point of the face's part has the same albedo: plain(part).
  bool is_plain(std::uint32_t triangle) const { return (faces_[triangle].flags & kPlain) != 0; }
  bool part_is_plain(std::uint32_t part) const { return plain_[part]; }
  Vec3f plain(std::uint32_t part) const { return albedo_[part]; }
  /// No albedo has a hue.
  bool grey() const { return grey_; }

  void prefetch(std::uint32_t triangle) const { __builtin_prefetch(&faces_[triangle]); }

 private:
  static constexpr std::uint8_t kDoubleSided = 1, kPlain = 2;
  struct Face {
    std::int8_t x, y, z;
    std::uint8_t flags;
  };
  std::vector<Face> faces_;
  std::vector<bool> plain_;    // of each part
  std::vector<Vec3f> albedo_;  // of each part
  bool grey_ = true;
};

}  // namespace kiln
