#include "core/bake/level_switch.h"

#include <algorithm>
#include <cmath>

#include "core/artifact/look.h"
#include "core/bake/field_eye.h"
#include "core/bake/preview.h"
#include "core/trace/surface.h"

namespace kiln {
namespace {

constexpr float kBackground = 0.2F;  // grey, linear: between the bright and the dark of a picture

/// An eye as far away as it takes to see the whole sphere under twice kHalfView.
struct Eye {
  static constexpr float kHalfView = 0.25F;  // sine
  Vec3f at, right, up, forward;

  Eye(const Vec3f& middle, float radius, const Vec3f& back) {
    right = normalized(cross(Vec3f{0, 1, 0}, back)), up = cross(back, right);
    at = middle + back * (radius / kHalfView), forward = -back;
  }
  Vec3f direction(int row, int column) const {
    const float tangent = kHalfView / std::sqrt(1 - kHalfView * kHalfView);
    const auto across = [&](int i) {
      return (2 * (static_cast<float>(i) + 0.5F) / LevelPictures::kFinest - 1) * tangent;
    };
    return normalized(forward + right * across(column) - up * across(row));
  }
};

std::vector<Eye> eyes_around(const Mesh& mesh) {
  Vec3f low = mesh.position.at(0), high = low;
  for (const Vec3f& p : mesh.position)
    for (std::size_t k = 0; k < 3; ++k) low[k] = std::min(low[k], p[k]), high[k] = std::max(high[k], p[k]);
  std::vector<Eye> out;
  for (int i = 0; i < LevelPictures::kEyes; ++i) {  // four about the horizon, two from above and below
    const float phi = 1.5707963F * static_cast<float>(i) + 0.5F, y = i == 4 ? 0.85F : i == 5 ? -0.85F : 0.25F;
    const float flat = std::sqrt(1 - y * y);
    const Vec3f back{flat * std::sin(phi), y, flat * std::cos(phi)};
    out.emplace_back((low + high) * 0.5F, std::max(length(high - low) / 2, 1e-6F), back);
  }
  return out;
}

/// A pixel of a smaller picture: the mean of times x times, over the background; and whether anything is there.
struct Small {
  Vec3d colour;
  bool covered = false;
};
Small average(const Vec4f* picture, int row, int column, int times) {
  Small out;
  for (int y = 0; y < times; ++y) {
    for (int x = 0; x < times; ++x) {
      const Vec4f& p = picture[(row * times + y) * LevelPictures::kFinest + column * times + x];
      out.covered |= p.w > 0;
      out.colour += to_double(p.w > 0 ? Vec3f{p.x, p.y, p.z} : Vec3f{1, 1, 1} * kBackground);
    }
  }
  out.colour = out.colour * (1.0 / (times * times));
  return out;
}

double difference(const Vec4f* a, const Vec4f* b, int times) {
  const int size = LevelPictures::kFinest / times;
  double squares = 0, pixels = 0;
  for (int row = 0; row < size; ++row) {
    for (int column = 0; column < size; ++column) {
      const Small x = average(a, row, column, times), y = average(b, row, column, times);
      if (!x.covered && !y.covered) continue;
      const Vec3d off = cielab(x.colour) - cielab(y.colour);
      squares += dot(off, off), pixels += 1;
    }
  }
  return pixels > 0 ? std::sqrt(squares / pixels) : 0;
}

}  // namespace

Vec3d cielab(const Vec3d& c) {
  const auto f = [](double t) { return t > 216.0 / 24389 ? std::cbrt(t) : (24389.0 / 27 * t + 16) / 116; };
  const double x = f((0.4124564 * c.x + 0.3575761 * c.y + 0.1804375 * c.z) / 0.95047);
  const double y = f(0.2126729 * c.x + 0.7151522 * c.y + 0.0721750 * c.z);
  const double z = f((0.0193339 * c.x + 0.1191920 * c.y + 0.9503041 * c.z) / 1.08883);
  return {116 * y - 16, 500 * (x - y), 200 * (y - z)};
}

LevelPictures level_pictures(const BakedScene& level, const Mesh& frame, Threads& threads) {
  constexpr std::size_t kSide = LevelPictures::kFinest;
  const std::vector<Eye> eyes = eyes_around(frame);
  const Tracer tracer(level.scene, threads);
  const FieldEye field(tracer.scene(), level.field, level.sky);
  LevelPictures out{std::vector<Vec4f>(kSide * kSide * LevelPictures::kEyes)};
  threads.for_blocks(kSide * LevelPictures::kEyes, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin * kSide; i < end * kSide; ++i) {
      const Eye& eye = eyes[i / (kSide * kSide)];
      const Vec3f direction = eye.direction(static_cast<int>(i / kSide % kSide), static_cast<int>(i % kSide));
      const Hit hit = first_facing(tracer, eye.at, direction);
      if (!hit) continue;
      const SurfacePoint place = surface_point(tracer.scene(), hit.triangle, hit.u, hit.v);
      const Vec3d seen = field.seen({hit.triangle, double{hit.u}, double{hit.v}, 0},
                                    normalized(to_double(place.normal)), normalized(to_double(-direction)));
      const Vec3f shown = tone_map(to_float(seen) * level.exposure);
      out.pixels[i] = {shown.x, shown.y, shown.z, 1};
    }
  });
  return out;
}

LevelSwitch level_switch(const LevelPictures& finer, const LevelPictures& coarser) {
  constexpr std::ptrdiff_t kPicture = LevelPictures::kFinest * LevelPictures::kFinest;
  LevelSwitch out;
  for (const int times : {32, 24, 16, 12, 8, 6, 4, 3, 2, 1}) {
    double worst = 0;
    for (int eye = 0; eye < LevelPictures::kEyes; ++eye)
      worst = std::max(worst, difference(&finer.pixels[static_cast<std::size_t>(eye * kPicture)],
                                         &coarser.pixels[static_cast<std::size_t>(eye * kPicture)], times));
    if (worst > LevelSwitch::kVisible) return out.pixels == 0 ? LevelSwitch{0, worst} : out;
    out = {LevelPictures::kFinest / times, worst};
  }
  return out;
}

}  // namespace kiln
