#include "core/scene/environment.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/expects.h"

namespace kiln {
namespace {

constexpr double kPi = std::numbers::pi;

/// The direction of the map that a rotation by `degrees` about +Y has moved to `w`.
Vec3d unrotated(const Vec3d& w, double degrees) {
  const double angle = degrees * kPi / 180;
  const double c = std::cos(angle), s = std::sin(angle);
  return {w.x * c - w.z * s, w.y, w.x * s + w.z * c};
}

Vec3f bilinear(const Environment& e, double x, double y) {
  const double fx = std::floor(x), fy = std::floor(y);
  const auto wrap = [&](double i) {
    const int n = static_cast<int>(i) % e.width;
    return static_cast<std::size_t>(n < 0 ? n + e.width : n);
  };
  const auto clamp = [&](double j) {
    return static_cast<std::size_t>(std::clamp(static_cast<int>(j), 0, e.height - 1));
  };
  const auto at = [&](std::size_t i, std::size_t j) { return e.radiance[j * static_cast<std::size_t>(e.width) + i]; };
  const auto tx = static_cast<float>(x - fx), ty = static_cast<float>(y - fy);
  const Vec3f top = at(wrap(fx), clamp(fy)) * (1 - tx) + at(wrap(fx + 1), clamp(fy)) * tx;
  const Vec3f bottom = at(wrap(fx), clamp(fy + 1)) * (1 - tx) + at(wrap(fx + 1), clamp(fy + 1)) * tx;
  return top * (1 - ty) + bottom * ty;
}

}  // namespace

Vec3f environment_radiance(const Environment& e, const Vec3f& w) {
  EXPECTS(e.radiance.size() == static_cast<std::size_t>(e.width) * static_cast<std::size_t>(e.height));
  const Vec3d d = unrotated(to_double(w), e.rotation_deg);
  const double u = 0.5 + std::atan2(d.z, d.x) / (2 * kPi);
  const double v = 0.5 - std::asin(std::clamp(d.y, -1.0, 1.0)) / kPi;
  return bilinear(e, u * e.width - 0.5, v * e.height - 0.5) * e.intensity;
}

Environment averaged_sky(int height, int parts, const std::function<Vec3f(const Vec3f&)>& radiance) {
  Environment out{.name = {}, .width = 2 * height, .height = height, .radiance = {}};
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      Vec3d sum;
      double all = 0;
      for (int i = 0; i < parts * parts; ++i) {
        const int row = i / parts, column = i % parts;
        const double v = (y + (row + 0.5) / parts) / out.height, u = (x + (column + 0.5) / parts) / out.width;
        const double up = kPi * (0.5 - v), around = 2 * kPi * (u - 0.5);
        const Vec3d w{std::cos(up) * std::cos(around), std::sin(up), std::cos(up) * std::sin(around)};
        sum += to_double(radiance(to_float(w))) * std::cos(up);
        all += std::cos(up);
      }
      out.radiance.push_back(to_float(sum / all));
    }
  }
  return out;
}

}  // namespace kiln
