#pragma once
// A scene as the bake sees it: validated, flattened to one mesh, recentred and scaled. Plain data.
//
// Everything past the importer may trust: all indices are in range, all numbers finite, all normals of unit length.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/vec.h"
#include "core/mesh/mesh.h"

namespace kiln {

/// world = center + scale * unit, computed in double. Unit positions lie in [-0.5, 0.5]^3.
struct Frame {
  Vec3d center;
  double scale = 1;

  Vec3d to_world(const Vec3d& unit) const { return center + unit * scale; }
  Vec3d to_unit(const Vec3d& world) const { return (world - center) / scale; }
};

enum class Wrap { repeat, mirror, clamp };

/// An image as it came, and its pixels. `rgba` is empty when the pixels are not needed or could not be decoded.
struct Image {
  std::string name;
  std::string mime;                   // "image/png" or "image/jpeg" (others are carried, not decoded)
  std::vector<std::uint8_t> encoded;  // the file's own bytes
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgba;  // height * width * 4, top row first, not linearised
};

struct Texture {
  int image = -1;
  Wrap wrap_u = Wrap::repeat, wrap_v = Wrap::repeat;
  bool nearest = false;
};

/// uv' = (m0 u + m1 v + m2, m3 u + m4 v + m5): KHR_texture_transform, applied to uv set `uv_set`.
struct TextureRef {
  int texture = -1;
  int uv_set = 0;
  std::array<float, 6> transform{1, 0, 0, 0, 1, 0};
  float scale = 1;  // normal texture scale
};

enum class AlphaMode { opaque, mask, blend };

struct Material {
  std::string name;
  Vec4f base_color{1, 1, 1, 1};   // linear factor
  TextureRef base_color_texture;  // sRGB
  float metallic = 1, roughness = 1;
  TextureRef metallic_roughness_texture;
  Vec3f emission;               // linear, emissiveFactor x emissiveStrength, W m^-2 sr^-1
  TextureRef emission_texture;  // sRGB
  TextureRef normal_texture;
  AlphaMode alpha_mode = AlphaMode::opaque;
  float alpha_cutoff = 0.5F;
  bool double_sided = false;
  bool unlit = false;
};

/// A run of triangles that came from one glTF primitive at one node. Parts do not share vertices.
struct Part {
  std::string name;
  int material = 0;  // index into Scene::materials, always valid
  bool has_uv0 = false, has_uv1 = false, has_color = false, has_tangent = false;
};

enum class LightType { directional, point, spot };

/// KHR_lights_punctual, numbers taken as radiometric. Position and range in unit-cube lengths;
/// point and spot intensity already divided by frame.scale^2, so that E = intensity / d^2 holds in unit lengths.
struct Light {
  LightType type = LightType::point;
  std::string name;
  Vec3f intensity;  // RGB: W m^-2 for directional, else W sr^-1 / frame.scale^2
  Vec3f position;
  Vec3f direction{0, 0, -1};                      // the way the light travels, unit
  float range = 0;                                // 0: infinite
  float inner_cone = 0, outer_cone = 0.7853982F;  // radians, spot only
};

/// What the input has and the bake does not honour, or had to mend.
struct Warning {
  std::string code;  // snake_case
  std::string message;
  std::string where;
};

struct Scene {
  Frame frame;
  Mesh mesh;
  std::vector<Part> parts;
  std::vector<Material> materials;
  std::vector<Texture> textures;
  std::vector<Image> images;
  std::vector<Light> lights;
  std::vector<Warning> warnings;
};

}  // namespace kiln
