#include "core/scene/texture.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace kiln {
namespace {

std::array<float, 256> srgb_table() {
  std::array<float, 256> table{};
  for (std::size_t i = 0; i < table.size(); ++i) {
    const double c = static_cast<double>(i) / 255;
    table[i] = static_cast<float>(c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4));
  }
  return table;
}

/// Brings any finite coordinate near [0, 1], so that texel numbers fit an int.
double fold(double u, Wrap wrap) {
  switch (wrap) {
    case Wrap::repeat:
      return u - std::floor(u);
    case Wrap::mirror:
      return u - 2 * std::floor(u / 2);
    case Wrap::clamp:
      break;
  }
  return std::clamp(u, -1.0, 2.0);
}

int wrapped(int texel, int size, Wrap wrap) {
  const auto modulo = [](int a, int n) { return (a % n + n) % n; };
  switch (wrap) {
    case Wrap::repeat:
      return modulo(texel, size);
    case Wrap::mirror: {
      const int i = modulo(texel, 2 * size);
      return i < size ? i : 2 * size - 1 - i;
    }
    case Wrap::clamp:
      break;
  }
  return std::clamp(texel, 0, size - 1);
}

struct Sampler {
  const Image& image;
  const Texture& texture;
  bool srgb;

  Vec4f texel(int x, int y) const {
    const auto row = static_cast<std::size_t>(wrapped(y, image.height, texture.wrap_v));
    const auto column = static_cast<std::size_t>(wrapped(x, image.width, texture.wrap_u));
    const std::uint8_t* p = image.rgba.data() + 4 * (row * static_cast<std::size_t>(image.width) + column);
    const auto colour = [&](int c) { return srgb ? linear_of_srgb(p[c]) : static_cast<float>(p[c]) / 255; };
    return {colour(0), colour(1), colour(2), static_cast<float>(p[3]) / 255};
  }

  Vec4f bilinear(double x, double y) const {
    const double x0 = std::floor(x), y0 = std::floor(y);
    const auto fx = static_cast<float>(x - x0), fy = static_cast<float>(y - y0);
    const int i = static_cast<int>(x0), k = static_cast<int>(y0);
    const Vec4f a = texel(i, k), b = texel(i + 1, k), c = texel(i, k + 1), d = texel(i + 1, k + 1);
    const auto mix = [&](float p, float q, float r, float s) {
      return (p * (1 - fx) + q * fx) * (1 - fy) + (r * (1 - fx) + s * fx) * fy;
    };
    return {mix(a.x, b.x, c.x, d.x), mix(a.y, b.y, c.y, d.y), mix(a.z, b.z, c.z, d.z), mix(a.w, b.w, c.w, d.w)};
  }
};

}  // namespace

float linear_of_srgb(std::uint8_t stored) {
  static const std::array<float, 256> kLinear = srgb_table();
  return kLinear[stored];
}

Vec4f sample_texture(const Scene& scene, const TextureRef& ref, const Vec2f& uv, bool srgb) {
  constexpr Vec4f kWhite{1, 1, 1, 1};
  if (ref.texture < 0) return kWhite;
  const Texture& texture = scene.textures[static_cast<std::size_t>(ref.texture)];
  if (texture.image < 0) return kWhite;
  const Image& image = scene.images[static_cast<std::size_t>(texture.image)];
  if (image.rgba.empty()) return kWhite;

  const auto& m = ref.transform;
  const double u = fold(double{m[0]} * uv.x + double{m[1]} * uv.y + m[2], texture.wrap_u) * image.width;
  const double v = fold(double{m[3]} * uv.x + double{m[4]} * uv.y + m[5], texture.wrap_v) * image.height;
  const Sampler sampler{image, texture, srgb};
  if (texture.nearest) return sampler.texel(static_cast<int>(std::floor(u)), static_cast<int>(std::floor(v)));
  return sampler.bilinear(u - 0.5, v - 0.5);
}

}  // namespace kiln
