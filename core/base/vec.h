#pragma once
// Small fixed-size vectors. Plain data, no SIMD: hot loops keep their own structure of arrays.

#include <array>
#include <cmath>
#include <cstddef>

namespace kiln {

template <class T>
struct Vec2 {
  T x{}, y{};
  friend Vec2 operator+(const Vec2& a, const Vec2& b) { return {a.x + b.x, a.y + b.y}; }
  friend Vec2 operator-(const Vec2& a, const Vec2& b) { return {a.x - b.x, a.y - b.y}; }
  friend Vec2 operator*(const Vec2& a, T s) { return {a.x * s, a.y * s}; }
  friend bool operator==(const Vec2&, const Vec2&) = default;
};

template <class T>
struct Vec3 {
  T x{}, y{}, z{};

  T& operator[](std::size_t i) { return i == 0 ? x : i == 1 ? y : z; }
  const T& operator[](std::size_t i) const { return i == 0 ? x : i == 1 ? y : z; }
  Vec3& operator+=(const Vec3& b) { return *this = *this + b; }
  Vec3& operator-=(const Vec3& b) { return *this = *this - b; }
  Vec3& operator*=(T s) { return *this = *this * s; }

  friend Vec3 operator+(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend Vec3 operator-(const Vec3& a) { return {-a.x, -a.y, -a.z}; }
  friend Vec3 operator*(const Vec3& a, const Vec3& b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
  friend Vec3 operator*(const Vec3& a, T s) { return {a.x * s, a.y * s, a.z * s}; }
  friend Vec3 operator*(T s, const Vec3& a) { return a * s; }
  friend Vec3 operator/(const Vec3& a, T s) { return {a.x / s, a.y / s, a.z / s}; }
  friend bool operator==(const Vec3&, const Vec3&) = default;
};

template <class T>
struct Vec4 {
  T x{}, y{}, z{}, w{};
  friend bool operator==(const Vec4&, const Vec4&) = default;
};

using Vec2f = Vec2<float>;
using Vec2d = Vec2<double>;
using Vec3f = Vec3<float>;
using Vec3d = Vec3<double>;
using Vec4f = Vec4<float>;

template <class T>
T dot(const Vec2<T>& a, const Vec2<T>& b) {
  return a.x * b.x + a.y * b.y;
}

/// Twice the area of the triangle 0, a, b; positive counter-clockwise.
template <class T>
T cross(const Vec2<T>& a, const Vec2<T>& b) {
  return a.x * b.y - a.y * b.x;
}

template <class T>
T length(const Vec2<T>& a) {
  return std::sqrt(dot(a, a));
}

template <class T>
T dot(const Vec3<T>& a, const Vec3<T>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

template <class T>
Vec3<T> cross(const Vec3<T>& a, const Vec3<T>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

template <class T>
T length(const Vec3<T>& a) {
  return std::sqrt(dot(a, a));
}

/// The unit vector along `a`, or `fallback` where `a` has no direction (zero or not finite).
template <class T>
Vec3<T> normalized(const Vec3<T>& a, const Vec3<T>& fallback = {T(0), T(1), T(0)}) {
  const T norm = length(a);
  return norm > T(0) && std::isfinite(norm) ? a / norm : fallback;
}

template <class T>
bool is_finite(const Vec3<T>& a) {
  return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z);
}

inline Vec3d to_double(const Vec3f& a) { return {a.x, a.y, a.z}; }
inline Vec3f to_float(const Vec3d& a) {
  return {static_cast<float>(a.x), static_cast<float>(a.y), static_cast<float>(a.z)};
}

/// An orthonormal frame whose z axis is `z` (Duff et al. 2017, "Building an Orthonormal Basis, Revisited").
template <class T>
struct Basis {
  Vec3<T> x, y, z;
  Vec3<T> to_world(const Vec3<T>& v) const { return x * v.x + y * v.y + z * v.z; }
  Vec3<T> to_local(const Vec3<T>& v) const { return {dot(v, x), dot(v, y), dot(v, z)}; }
};

template <class T>
Basis<T> basis_around(const Vec3<T>& n) {
  const T sign = std::copysign(T(1), n.z);
  const T a = T(-1) / (sign + n.z);
  const T b = n.x * n.y * a;
  return {{T(1) + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}, n};
}

}  // namespace kiln
