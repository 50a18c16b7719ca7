#pragma once
// How bright an image is over a triangle of texture space: what tells the lit windows of a textured lamp from its iron.
//
// Sums over blocks of texels in a summed-area table (Crow 1984) of whole numbers: nothing is lost to rounding, so 0
// says that every texel is black which a look-up in the triangle could read. The triangle is covered by at most
// kBoxes^2 boxes, each wider by what bilinear filtering and rounded coordinates reach; boxes that miss it are left out.
// Cost    8 bytes a block, at most kBlocks^2 blocks; a small triangle takes as many boxes as it touches texels
// Error   the mean is of the boxes: of the triangle and a margin around it

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/vec.h"
#include "core/scene/scene.h"

namespace kiln {

class BrightnessTable {
 public:
  static constexpr std::int64_t kBlocks = 1024;
  static constexpr int kBoxes = 8;

  /// Of an image with pixels; sRGB is decoded.
  explicit BrightnessTable(const Image&);

  /// Mean of red, green and blue over a triangle, [0, 1]: of corners in texture widths and heights, before the
  /// texture's wrap modes. `blur` is how far a look-up may be off them, in the same unit.
  double mean(const std::array<Vec2d, 3>& corners, double blur, const Texture&) const;

 private:
  struct Axis {
    std::int64_t size, block;
  };
  struct Sums {
    double brightness = 0, texels = 0;
  };
  Sums over_blocks(std::int64_t x0, std::int64_t x1, std::int64_t y0, std::int64_t y1) const;
  Sums over_box(const Vec2d& low, const Vec2d& high, const Texture&) const;

  Axis x_, y_;
  std::int64_t columns_, rows_;
  std::vector<std::uint64_t> sums_;  // (rows + 1) x (columns + 1): of all blocks above and to the left
};

}  // namespace kiln
