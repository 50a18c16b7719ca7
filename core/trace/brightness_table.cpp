#include "core/trace/brightness_table.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/expects.h"
#include "core/scene/texture.h"

namespace kiln {
namespace {

constexpr double kOne = 65535;      // what a white texel adds to the sums
constexpr double kFarthest = 1e12;  // texels: beyond it a coordinate does not tell one from the next

/// Up: what is not black is not 0.
std::uint64_t brightness(const std::uint8_t* rgba) {
  const double sum = double{linear_of_srgb(rgba[0])} + linear_of_srgb(rgba[1]) + linear_of_srgb(rgba[2]);
  return static_cast<std::uint64_t>(std::ceil(sum / 3 * kOne));
}

using Run = std::pair<std::int64_t, std::int64_t>;  // first and last texel

/// Where the texels of [first, last] lie in an image of `size`; all of it where they go around.
std::vector<Run> wrapped(std::int64_t first, std::int64_t last, std::int64_t size, Wrap wrap) {
  if (wrap == Wrap::clamp)
    return {{std::clamp<std::int64_t>(first, 0, size - 1), std::clamp<std::int64_t>(last, 0, size - 1)}};
  const std::int64_t period = wrap == Wrap::mirror ? 2 * size : size, count = last - first + 1;
  if (count >= period) return {{0, size - 1}};
  std::vector<Run> runs;
  for (std::int64_t at = (first % period + period) % period, left = count; left > 0;) {
    const std::int64_t turn = at < size ? size : 2 * size, end = std::min(at + left, turn) - 1;
    runs.push_back(at < size ? Run{at, end} : Run{2 * size - 1 - end, 2 * size - 1 - at});
    left -= end - at + 1;
    at = (end + 1) % period;
  }
  return runs;
}

/// Separating axes: the edges of the triangle. The box lies in the triangle's own box already.
bool meets(const std::array<Vec2d, 3>& triangle, const Vec2d& middle, const Vec2d& half) {
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec2d &a = triangle[k], &b = triangle[(k + 1) % 3], &c = triangle[(k + 2) % 3];
    const Vec2d n{a.y - b.y, b.x - a.x};
    const auto along = [&](const Vec2d& p) { return n.x * (p.x - a.x) + n.y * (p.y - a.y); };
    const double inside = along(c), box = along(middle), reach = std::abs(n.x) * half.x + std::abs(n.y) * half.y;
    if (box + reach < std::min(0.0, inside) || box - reach > std::max(0.0, inside)) return false;
  }
  return true;
}

}  // namespace

BrightnessTable::BrightnessTable(const Image& image) : x_{image.width, 1}, y_{image.height, 1} {
  EXPECTS(!image.rgba.empty());
  for (Axis* axis : {&x_, &y_}) axis->block = (axis->size + kBlocks - 1) / kBlocks;
  columns_ = (x_.size + x_.block - 1) / x_.block;
  rows_ = (y_.size + y_.block - 1) / y_.block;
  const auto stride = static_cast<std::size_t>(columns_ + 1);
  sums_.assign(stride * static_cast<std::size_t>(rows_ + 1), 0);
  const std::uint8_t* texel = image.rgba.data();
  for (std::int64_t y = 0; y < y_.size; ++y) {
    std::uint64_t* row = sums_.data() + stride * static_cast<std::size_t>(y / y_.block + 1) + 1;
    for (std::int64_t x = 0; x < x_.size; ++x, texel += 4) row[x / x_.block] += brightness(texel);
  }
  for (std::size_t y = 1; y <= static_cast<std::size_t>(rows_); ++y) {
    for (std::size_t x = 1; x < stride; ++x)
      sums_[y * stride + x] +=
          sums_[y * stride + x - 1] + sums_[(y - 1) * stride + x] - sums_[(y - 1) * stride + x - 1];
  }
}

BrightnessTable::Sums BrightnessTable::over_blocks(std::int64_t x0, std::int64_t x1, std::int64_t y0,
                                                   std::int64_t y1) const {
  const auto at = [&](std::int64_t x, std::int64_t y) {
    return sums_[static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_ + 1) + static_cast<std::size_t>(x)];
  };
  const std::int64_t wide = std::min((x1 + 1) * x_.block, x_.size) - x0 * x_.block,
                     high = std::min((y1 + 1) * y_.block, y_.size) - y0 * y_.block;
  return {static_cast<double>(at(x1 + 1, y1 + 1) - at(x0, y1 + 1) - at(x1 + 1, y0) + at(x0, y0)),
          static_cast<double>(wide) * static_cast<double>(high)};
}

BrightnessTable::Sums BrightnessTable::over_box(const Vec2d& low, const Vec2d& high, const Texture& texture) const {
  const auto texel = [](double x) { return static_cast<std::int64_t>(std::floor(x)); };
  Sums sums;
  for (const auto& [x0, x1] : wrapped(texel(low.x), texel(high.x), x_.size, texture.wrap_u)) {
    for (const auto& [y0, y1] : wrapped(texel(low.y), texel(high.y), y_.size, texture.wrap_v)) {
      const Sums part = over_blocks(x0 / x_.block, x1 / x_.block, y0 / y_.block, y1 / y_.block);
      sums.brightness += part.brightness;
      sums.texels += part.texels;
    }
  }
  return sums;
}

double BrightnessTable::mean(const std::array<Vec2d, 3>& corners, double blur, const Texture& texture) const {
  const Vec2d size{static_cast<double>(x_.size), static_cast<double>(y_.size)};
  std::array<Vec2d, 3> triangle;
  Vec2d low{kFarthest, kFarthest}, high{-kFarthest, -kFarthest};
  for (std::size_t k = 0; k < 3; ++k) {
    triangle[k] = {corners[k].x * size.x, corners[k].y * size.y};
    low = {std::min(low.x, triangle[k].x), std::min(low.y, triangle[k].y)};
    high = {std::max(high.x, triangle[k].x), std::max(high.y, triangle[k].y)};
  }
  const Vec2d margin{0.5 + blur * size.x, 0.5 + blur * size.y};  // half a texel: bilinear filtering
  const auto near_enough = [](double x) { return std::abs(x) < kFarthest; };
  Sums all;
  if (!near_enough(low.x) || !near_enough(low.y) || !near_enough(high.x) || !near_enough(high.y) ||
      !near_enough(margin.x) || !near_enough(margin.y)) {
    all = over_blocks(0, columns_ - 1, 0, rows_ - 1);
    return all.brightness / all.texels / kOne;
  }
  const auto boxes = [](double span) {
    return std::clamp(static_cast<int>(std::ceil(std::min(span, 1e6))), 1, kBoxes);
  };
  const int nx = boxes(high.x - low.x), ny = boxes(high.y - low.y);
  const Vec2d half{(high.x - low.x) / nx / 2, (high.y - low.y) / ny / 2}, reach{half.x + margin.x, half.y + margin.y};
  for (int j = 0; j < ny; ++j) {
    for (int i = 0; i < nx; ++i) {
      const Vec2d middle{low.x + (2 * i + 1) * half.x, low.y + (2 * j + 1) * half.y};
      if (!meets(triangle, middle, reach)) continue;
      const Sums box =
          over_box({middle.x - reach.x, middle.y - reach.y}, {middle.x + reach.x, middle.y + reach.y}, texture);
      all.brightness += box.brightness;
      all.texels += box.texels;
    }
  }
  return all.texels > 0 ? all.brightness / all.texels / kOne : 0;
}

}  // namespace kiln
