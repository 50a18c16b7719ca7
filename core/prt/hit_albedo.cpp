#include "core/prt/hit_albedo.h"

#include <algorithm>
#include <cmath>

namespace kiln {
namespace {

constexpr float kMaxAlbedo = 0.999F;  // as albedo_at

constexpr float kFarAway = 1e6F;  // coordinates beyond this keep no fraction worth a texel

float floor_of(float x) {  // std::floor is a call without SSE 4.1
  const auto whole = static_cast<float>(static_cast<int>(x));
  return whole > x ? whole - 1 : whole;
}

// The texel under a coordinate, shifted by up to half a texel.
int wrap_texel(float coordinate, int size, Wrap wrap, float shift) {
  coordinate = std::clamp(coordinate, -kFarAway, kFarAway);
  if (wrap == Wrap::repeat) coordinate -= floor_of(coordinate);
  if (wrap == Wrap::mirror) coordinate -= 2 * floor_of(0.5F * coordinate);
  if (wrap == Wrap::clamp) coordinate = std::clamp(coordinate, -1.0F, 2.0F);
  int texel = static_cast<int>(floor_of(coordinate * static_cast<float>(size) + shift));
  const int period = wrap == Wrap::mirror ? 2 * size : size;
  if (wrap != Wrap::clamp && texel < 0) texel += period;
  if (wrap != Wrap::clamp && texel >= period) texel -= period;
  if (wrap == Wrap::mirror && texel >= size) texel = 2 * size - 1 - texel;
  return std::clamp(texel, 0, size - 1);
}

}  // namespace

HitAlbedo::HitAlbedo(const Scene& scene) : mesh_(scene.mesh) {
  for (int i = 0; i < 256; ++i) {  // IEC 61966-2-1
    const double c = i / 255.0;
    linear_[static_cast<std::size_t>(i)] =
        static_cast<float>(c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4));
  }
  for (const Part& part : scene.parts) {
    const Material& material = scene.materials[static_cast<std::size_t>(part.material)];
    const Vec4f& f = material.base_color;
    Source source{.factor = {f.x, f.y, f.z}, .tinted = part.has_color && !scene.mesh.color.empty()};
    const TextureRef& ref = material.base_color_texture;
    const Texture* texture = ref.texture < 0 ? nullptr : &scene.textures[static_cast<std::size_t>(ref.texture)];
    if (texture != nullptr && texture->image >= 0 &&
        !scene.images[static_cast<std::size_t>(texture->image)].rgba.empty()) {
      const Image& image = scene.images[static_cast<std::size_t>(texture->image)];
      source.texels = image.rgba.data();
      source.width = image.width, source.height = image.height;
      source.wrap_u = texture->wrap_u, source.wrap_v = texture->wrap_v;
      source.nearest = texture->nearest;
      source.uv = ref.uv_set == 1 ? &scene.mesh.uv1 : &scene.mesh.uv0;
      source.transform = ref.transform;
    }
    sources_.push_back(source);
  }
}

void HitAlbedo::prefetch(std::uint32_t triangle) const {
  const Source& source = sources_[mesh_.part[triangle]];
  for (const std::uint32_t v : mesh_.triangles[triangle]) {
    if (source.texels != nullptr && !source.uv->empty()) __builtin_prefetch(&(*source.uv)[v]);
    if (source.tinted) __builtin_prefetch(&mesh_.color[v]);
  }
}

HitAlbedo::Tap HitAlbedo::tap(std::uint32_t triangle, float u, float v, std::uint32_t draw) const {
  const Source& source = sources_[mesh_.part[triangle]];
  const auto& [a, b, c] = mesh_.triangles[triangle];
  const float w = 1 - u - v;
  Tap tap{.texel = nullptr, .tint = source.factor};
  if (source.tinted) {
    const Vec4f &p = mesh_.color[a], &q = mesh_.color[b], &r = mesh_.color[c];
    tap.tint = tap.tint * Vec3f{w * p.x + u * q.x + v * r.x, w * p.y + u * q.y + v * r.y, w * p.z + u * q.z + v * r.z};
  }
  if (source.texels == nullptr) return tap;
  Vec2f uv;
  if (!source.uv->empty()) {
    const Vec2f &p = (*source.uv)[a], &q = (*source.uv)[b], &r = (*source.uv)[c];
    uv = {w * p.x + u * q.x + v * r.x, w * p.y + u * q.y + v * r.y};
  }
  tap.texel = find_texel(source, uv, draw);
  __builtin_prefetch(tap.texel);
  return tap;
}

const std::uint8_t* HitAlbedo::find_texel(const Source& source, const Vec2f& uv, std::uint32_t draw) const {
  const auto& m = source.transform;
  const float shift_x = source.nearest ? 0 : static_cast<float>(draw >> 16) * 0x1p-16F - 0.5F;
  const float shift_y = source.nearest ? 0 : static_cast<float>(draw & 0xffffU) * 0x1p-16F - 0.5F;
  const int x = wrap_texel(m[0] * uv.x + m[1] * uv.y + m[2], source.width, source.wrap_u, shift_x);
  const int y = wrap_texel(m[3] * uv.x + m[4] * uv.y + m[5], source.height, source.wrap_v, shift_y);
  return source.texels + 4 * (static_cast<std::ptrdiff_t>(y) * source.width + x);
}

Vec3f HitAlbedo::read(const Tap& tap) const {
  Vec3f albedo = tap.tint;
  if (tap.texel != nullptr) {
    albedo = albedo * Vec3f{linear_[tap.texel[0]], linear_[tap.texel[1]], linear_[tap.texel[2]]};
  }
  const auto limited = [](float x) { return std::clamp(x, 0.0F, kMaxAlbedo); };
  return {limited(albedo.x), limited(albedo.y), limited(albedo.z)};
}

}  // namespace kiln
