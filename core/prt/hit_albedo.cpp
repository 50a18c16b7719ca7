#include "core/prt/hit_albedo.h"

#include <algorithm>
#include <cmath>

namespace kiln {
namespace {

constexpr float kMaxAlbedo = 0.999F;  // as albedo_at

constexpr int kMostTexels = 128;  // a side: 64 KB an image, so that taps stay in the cache
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
      const bool whole = material.alpha_mode != AlphaMode::opaque;  // hidden texels have no say
      source.image = use_image(image, texture->image, whole);
      source.wrap_u = texture->wrap_u, source.wrap_v = texture->wrap_v;
      source.nearest = texture->nearest;
      source.uv = ref.uv_set == 1 ? &scene.mesh.uv1 : &scene.mesh.uv0;
      source.transform = ref.transform;
    }
    sources_.push_back(source);
  }
}

std::size_t HitAlbedo::use_image(const Image& image, int index, bool whole) {
  const auto known = std::find_if(images_.begin(), images_.end(),
                                  [&](const Reduced& r) { return r.index == index && r.whole == whole; });
  if (known != images_.end()) return static_cast<std::size_t>(known - images_.begin());
  Reduced to{.index = index, .whole = whole, .width = image.width, .height = image.height};
  if (!whole) to.width = std::min(to.width, kMostTexels), to.height = std::min(to.height, kMostTexels);
  for (int y = 0; y < to.height; ++y) {
    for (int x = 0; x < to.width; ++x) {
      for (std::size_t c = 0; c < 4; ++c)
        to.rgba.push_back(c < 3 ? mean_texel(image, to, {x, y}, c) : std::uint8_t{255});
    }
  }
  images_.push_back(std::move(to));
  return images_.size() - 1;
}

// The mean of the texels that one texel of `to` stands for, in linear light, back in sRGB.
std::uint8_t HitAlbedo::mean_texel(const Image& image, const Reduced& to, std::array<int, 2> at, std::size_t c) const {
  const int x0 = at[0] * image.width / to.width, x1 = (at[0] + 1) * image.width / to.width;
  const int y0 = at[1] * image.height / to.height, y1 = (at[1] + 1) * image.height / to.height;
  double sum = 0;
  for (int y = y0; y < y1; ++y) {
    const std::uint8_t* row = image.rgba.data() + 4 * (std::ptrdiff_t{y} * image.width);
    for (int x = x0; x < x1; ++x) sum += linear_[row[4 * x + static_cast<int>(c)]];
  }
  const auto mean = static_cast<float>(sum / ((x1 - x0) * (y1 - y0)));
  const auto above = std::lower_bound(linear_.begin(), linear_.end(), mean);
  if (above == linear_.begin()) return 0;
  if (above == linear_.end()) return 255;
  return static_cast<std::uint8_t>((above - linear_.begin()) - (mean - above[-1] < *above - mean ? 1 : 0));
}

void HitAlbedo::prefetch(std::uint32_t triangle) const {
  const Source& source = sources_[mesh_.part[triangle]];
  for (const std::uint32_t v : mesh_.triangles[triangle]) {
    if (source.image != kNone && !source.uv->empty()) __builtin_prefetch(&(*source.uv)[v]);
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
  if (source.image == kNone) return tap;
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
  const Reduced& image = images_[source.image];
  const float shift_x = source.nearest ? 0 : static_cast<float>(draw >> 16) * 0x1p-16F - 0.5F;
  const float shift_y = source.nearest ? 0 : static_cast<float>(draw & 0xffffU) * 0x1p-16F - 0.5F;
  const int x = wrap_texel(m[0] * uv.x + m[1] * uv.y + m[2], image.width, source.wrap_u, shift_x);
  const int y = wrap_texel(m[3] * uv.x + m[4] * uv.y + m[5], image.height, source.wrap_v, shift_y);
  return image.rgba.data() + 4 * (static_cast<std::ptrdiff_t>(y) * image.width + x);
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
