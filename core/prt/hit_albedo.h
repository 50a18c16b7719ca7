#pragma once
// Reflectance where a gathering ray lands, at the price of one texel.
//
// A tap draws one of the four texels of the bilinear filter with its weight as probability: the expectation over draws
// is albedo_at of core/trace/surface.h (but for the clamp to 0.999 of a single texel). Taps are made early and read
// late, so that the texel is in the cache by then.

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
  struct Source {
    Vec3f factor;
    bool tinted = false;  // by vertex colours
    bool nearest = false;
    const std::uint8_t* texels = nullptr;
    int width = 0, height = 0;
    Wrap wrap_u = Wrap::repeat, wrap_v = Wrap::repeat;
    const std::vector<Vec2f>* uv = nullptr;
    std::array<float, 6> transform{};
  };
  const std::uint8_t* find_texel(const Source&, const Vec2f& uv, std::uint32_t draw) const;

  const Mesh& mesh_;
  std::vector<Source> sources_;  // of each part
  std::array<float, 256> linear_;
};

}  // namespace kiln
