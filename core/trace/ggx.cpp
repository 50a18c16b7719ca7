#include "core/trace/ggx.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace kiln {
namespace {

double square(double x) { return x * x; }

double distribution(double alpha, double nh) {
  const double a2 = square(alpha), d = square(nh) * (a2 - 1) + 1;
  return a2 / (std::numbers::pi * square(d));
}

/// Smith's Lambda: masking of one direction is 1 / (1 + Lambda), of two 1 / (1 + Lambda(v) + Lambda(l)).
double lambda(double alpha, double z) {
  const double tan2 = (1 - square(z)) / square(z);
  return (std::sqrt(1 + square(alpha) * std::max(0.0, tan2)) - 1) / 2;
}

Vec3d half_way(const Vec3d& v, const Vec3d& l) { return normalized(v + l, Vec3d{0, 0, 1}); }

}  // namespace

double ggx_alpha(double roughness) { return std::clamp(square(roughness), kLeastAlpha, 1.0); }

Vec3d specular_f0(const Vec3d& base_color, double metallic) {
  return Vec3d{1, 1, 1} * (kDielectricF0 * (1 - metallic)) + base_color * metallic;
}

Vec3d diffuse_color(const Vec3d& base_color, double metallic) { return base_color * (1 - metallic); }

double ggx_cosine(double alpha, const Vec3d& v, const Vec3d& l) {
  if (!(v.z > 0) || !(l.z > 0)) return 0;
  const double masking = 1 / (1 + lambda(alpha, v.z) + lambda(alpha, l.z));
  return distribution(alpha, half_way(v, l).z) * masking / (4 * v.z);
}

double schlick_weight(const Vec3d& v, const Vec3d& l) {
  const double m = std::clamp(1 - dot(v, half_way(v, l)), 0.0, 1.0);
  return square(square(m)) * m;
}

// Visible normals of the stretched hemisphere are a projected disk.
GgxSample sample_ggx(double alpha, const Vec3d& v, const Vec2<double>& u) {
  const Vec3d stretched = normalized(Vec3d{alpha * v.x, alpha * v.y, v.z});
  const Basis<double> basis = basis_around(stretched);
  const double r = std::sqrt(u.x), phi = 2 * std::numbers::pi * u.y, s = (1 + stretched.z) / 2;
  // The disk's second axis must lie in the plane of the normal: the half of it that is turned away is squeezed.
  const Vec3d across = normalized(Vec3d{-stretched.y, stretched.x, 0}, basis.x), along = cross(stretched, across);
  const double t1 = r * std::cos(phi);
  const double t2 = (1 - s) * std::sqrt(std::max(0.0, 1 - t1 * t1)) + s * r * std::sin(phi);
  const double t3 = std::sqrt(std::max(0.0, 1 - t1 * t1 - t2 * t2));
  const Vec3d n = across * t1 + along * t2 + stretched * t3;
  const Vec3d h = normalized(Vec3d{alpha * n.x, alpha * n.y, std::max(1e-12, n.z)});
  const Vec3d l = normalized(h * (2 * dot(v, h)) - v);
  if (!(l.z > 0)) return {l, 0};
  const double view = lambda(alpha, v.z);
  return {l, (1 + view) / (1 + view + lambda(alpha, l.z))};
}

double ggx_density(double alpha, const Vec3d& v, const Vec3d& l) {
  if (!(v.z > 0) || !(l.z > 0)) return 0;
  return distribution(alpha, half_way(v, l).z) / (1 + lambda(alpha, v.z)) / (4 * v.z);
}

}  // namespace kiln
