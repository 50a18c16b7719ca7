#pragma once
// Reflectance where a gathering ray lands, at the price of one texel.
//
// Textures of opaque materials are first reduced to 128 texels a side (means in linear light): a gathered value is a
// mean over hundreds of hits spread over the scene, and random reads of large images cost more than their rays.
// A tap draws one of the four texels of the bilinear filter with its weight as probability: the expectation over draws
// is albedo_at of core/trace/surface.h (where nothing was reduced, and but for the clamp to 0.999 of a single texel).
// Taps are made early and read late, so that the texel is in the cache by then.

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/vec.h"
#include "core/scene/scene.h"

namespace kiln {

class HitAlbedo {
 public:
  /// Keeps a reference to the scene.
  explicit HitAlbedo(const Scene&);

  struct Tap {
    const std::uint8_t* texel = nullptr;  // sRGB; null: white
    Vec3f tint;                           // factor x vertex colour
  };
  /// Asks for what a tap of this face will read.
  void prefetch(std::uint32_t triangle) const;
  /// `draw` is 32 random bits. Asks for the texel's memory.
  Tap tap(std::uint32_t triangle, float u, float v, std::uint32_t draw) const;
  Vec3f read(const Tap&) const;

 private:
  static constexpr std::size_t kNone = ~std::size_t{0};
  struct Reduced {
    int index = 0;       // of the scene's image
    bool whole = false;  // not reduced
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgba{};
  };
  struct Source {
    Vec3f factor;
    bool tinted = false;  // by vertex colours
    bool nearest = false;
    std::size_t image = kNone;
    Wrap wrap_u = Wrap::repeat, wrap_v = Wrap::repeat;
    const std::vector<Vec2f>* uv = nullptr;
    std::array<float, 6> transform{};
  };
  std::size_t use_image(const Image&, int index, bool whole);
  std::uint8_t mean_texel(const Image&, const Reduced& to, std::array<int, 2> at, std::size_t channel) const;
  const std::uint8_t* find_texel(const Source&, const Vec2f& uv, std::uint32_t draw) const;

  const Mesh& mesh_;
  std::vector<Source> sources_;  // of each part
  std::vector<Reduced> images_;
  std::array<float, 256> linear_;
};

}  // namespace kiln
