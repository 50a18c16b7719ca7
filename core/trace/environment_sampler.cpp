#include "core/trace/environment_sampler.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <numeric>

#include "core/base/expects.h"

namespace kiln {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kMaxWidth = 1024, kMaxHeight = 512;

/// Bilinear look-ups carry a texel's light half a texel further, so a cell also owns part of its neighbours'.
constexpr double kSpread[3] = {0.125, 0.75, 0.125};

double brightness(const Vec3f& c) { return std::max(0.0, double{c.x} + double{c.y} + double{c.z}); }

/// The step of the running sums [begin, end) that holds `wanted`, and how far through that step it is.
struct Pick {
  int index;
  double through;
};

Pick pick(const double* begin, const double* end, double wanted) {
  const double* found = std::upper_bound(begin, end - 1, wanted);
  const double before = found == begin ? 0 : found[-1];
  return {static_cast<int>(found - begin), std::clamp((wanted - before) / std::max(*found - before, 1e-300), 0.0, 1.0)};
}

}  // namespace

double EnvironmentSampler::height_at(int row) const { return std::cos(kPi * row / height_); }

EnvironmentSampler::EnvironmentSampler(const Environment& e)
    : cosine_(std::cos(e.rotation_deg * kPi / 180)), sine_(std::sin(e.rotation_deg * kPi / 180)) {
  if (e.width * e.height <= 1) return;
  width_ = std::min(e.width, kMaxWidth), height_ = std::min(e.height, kMaxHeight);
  cells_.assign(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), 0);
  for (int y = 0; y < e.height; ++y) {
    const double area = std::cos(kPi * y / e.height) - std::cos(kPi * (y + 1) / e.height);
    for (int x = 0; x < e.width; ++x) {
      const auto texel = static_cast<std::size_t>(y) * static_cast<std::size_t>(e.width) + static_cast<std::size_t>(x);
      const double light = brightness(e.radiance[texel]) * area;
      for (int k = 0; k < 9; ++k) {
        const int nx = (x + k % 3 - 1 + e.width) % e.width, ny = std::clamp(y + k / 3 - 1, 0, e.height - 1);
        const auto cell = static_cast<std::size_t>(std::int64_t{ny} * height_ / e.height * width_ +
                                                   std::int64_t{nx} * width_ / e.width);
        cells_[cell] += light * kSpread[k % 3] * kSpread[k / 3];
      }
    }
  }
  for (int row = 0; row < height_; ++row) {
    const auto begin = cells_.begin() + std::ptrdiff_t{row} * width_;
    std::partial_sum(begin, begin + width_, begin);
    total_ += begin[width_ - 1];
    rows_.push_back(total_);
  }
}

Vec3d EnvironmentSampler::sample(const Vec2<double>& u) const {
  EXPECTS(useful());
  const auto [row, down] = pick(rows_.data(), rows_.data() + height_, u.y * total_);
  const double* cells = cells_.data() + std::ptrdiff_t{row} * width_;
  const auto [column, across] = pick(cells, cells + width_, u.x * cells[width_ - 1]);
  const double y = height_at(row) + (height_at(row + 1) - height_at(row)) * down;
  const double phi = 2 * kPi * ((column + across) / width_ - 0.5), radius = std::sqrt(std::max(0.0, 1 - y * y));
  const double x = radius * std::cos(phi), z = radius * std::sin(phi);
  return {x * cosine_ + z * sine_, y, z * cosine_ - x * sine_};
}

double EnvironmentSampler::density(const Vec3d& w) const {
  if (!useful()) return 0;
  const double x = w.x * cosine_ - w.z * sine_, z = w.x * sine_ + w.z * cosine_;
  const double u = 0.5 + std::atan2(z, x) / (2 * kPi), v = std::acos(std::clamp(w.y, -1.0, 1.0)) / kPi;
  const int column = std::clamp(static_cast<int>(u * width_), 0, width_ - 1);
  const int row = std::clamp(static_cast<int>(v * height_), 0, height_ - 1);
  const double area = (height_at(row) - height_at(row + 1)) * 2 * kPi / width_;
  const double* cells = cells_.data() + std::ptrdiff_t{row} * width_;
  return (cells[column] - (column == 0 ? 0 : cells[column - 1])) / (total_ * area);
}

}  // namespace kiln
