#include <cmath>
#include <limits>

#include "core/artifact/gltf_parse_parts.h"

namespace kiln::gltf {
namespace {

template <std::size_t N>
std::array<float, N> reals(const Fields& f, const char* key, std::array<double, N> absent) {
  std::array<float, N> out{};
  const std::array<double, N> wide = f.numbers<N>(key, absent);
  for (std::size_t i = 0; i < N; ++i) {
    if (std::abs(wide[i]) > 1e30) f.findings().fail("number_out_of_range", "The number is too large.", f.pointer(key));
    out[i] = static_cast<float>(wide[i]);
  }
  return out;
}

Vec3f color3(const Fields& f, const char* key, double absent) {
  const auto c = reals<3>(f, key, {absent, absent, absent});
  return {c[0], c[1], c[2]};
}

/// KHR_texture_transform: uv' = offset + R(rotation) (scale * uv), counter-clockwise with v running downwards.
void parse_transform(const Fields& f, TextureRef& ref) {
  const auto offset = reals<2>(f, "offset", {0, 0}), scale = reals<2>(f, "scale", {1, 1});
  const float angle = real(f, "rotation", 0), c = std::cos(angle), s = std::sin(angle);
  ref.transform = {c * scale[0], s * scale[1], offset[0], -s * scale[0], c * scale[1], offset[1]};
  ref.uv_set =
      static_cast<int>(std::min<std::uint64_t>(f.count("texCoord", static_cast<std::uint64_t>(ref.uv_set)), 1000));
}

TextureRef parse_texture_ref(const Fields& f, const char* key, const Sizes& sizes) {
  TextureRef ref;
  if (!f.has(key)) return ref;
  const Fields info = f.object(key);
  ref.texture = info.index("index", sizes.textures);
  ref.uv_set = static_cast<int>(std::min<std::uint64_t>(info.count("texCoord", 0), 1000));
  ref.scale = real(info, "scale", 1);
  if (info.has_extension("KHR_texture_transform")) parse_transform(info.extension("KHR_texture_transform"), ref);
  if (ref.uv_set > 1) {
    f.findings().warn("texture_uv_set_ignored", "Only TEXCOORD_0 and TEXCOORD_1 are read; the texture is left out.",
                      info.pointer());
    ref.texture = -1;
    ref.uv_set = 0;
  }
  return ref;
}

void parse_metallic_roughness(const Fields& f, const Sizes& sizes, Material& m) {
  const auto c = reals<4>(f, "baseColorFactor", {1, 1, 1, 1});
  m.base_color = {c[0], c[1], c[2], c[3]};
  m.base_color_texture = parse_texture_ref(f, "baseColorTexture", sizes);
  m.metallic = real(f, "metallicFactor", 1);
  m.roughness = real(f, "roughnessFactor", 1);
  m.metallic_roughness_texture = parse_texture_ref(f, "metallicRoughnessTexture", sizes);
}

void parse_specular_glossiness(const Fields& f, const Sizes& sizes, Material& m) {
  const auto c = reals<4>(f, "diffuseFactor", {1, 1, 1, 1});
  m.base_color = {c[0], c[1], c[2], c[3]};
  m.base_color_texture = parse_texture_ref(f, "diffuseTexture", sizes);
  m.metallic = 0;
  m.roughness = 1 - real(f, "glossinessFactor", 1);
  m.metallic_roughness_texture = {};
}

AlphaMode parse_alpha_mode(const Fields& f) {
  const std::string mode = f.text("alphaMode");
  if (mode == "MASK") return AlphaMode::mask;
  if (mode == "BLEND") return AlphaMode::blend;
  if (!mode.empty() && mode != "OPAQUE")
    f.findings().fail("unknown_enum", "The alpha mode is not known.", f.pointer("alphaMode"));
  return AlphaMode::opaque;
}

Wrap parse_wrap(const Fields& f, const char* key) {
  switch (f.count(key, 10497)) {
    case 10497:
      return Wrap::repeat;
    case 33071:
      return Wrap::clamp;
    case 33648:
      return Wrap::mirror;
    default:
      f.findings().fail("unknown_enum", "The wrap mode is not known.", f.pointer(key));
      return Wrap::repeat;
  }
}

/// The image of a texture: the core one, or else one of a format that is carried undecoded.
int parse_source(const Fields& f, const Sizes& sizes) {
  if (f.has("source")) return f.index("source", sizes.images);
  for (const char* name : {"KHR_texture_basisu", "EXT_texture_webp", "EXT_texture_avif", "MSFT_texture_dds"}) {
    if (!f.has_extension(name)) continue;
    f.findings().warn("texture_not_decoded",
                      std::string("A texture has only the form of ") + name + "; it is baked as white.", f.pointer());
    return f.extension(name).index("source", sizes.images);
  }
  return -1;
}

}  // namespace

float real(const Fields& f, const char* key, double absent) {
  const double x = f.number(key, absent);
  if (std::abs(x) > 1e30) f.findings().fail("number_out_of_range", "The number is too large.", f.pointer(key));
  return static_cast<float>(x);
}

ImageSource parse_image(const Fields& f, const Sizes& sizes) {
  ImageSource image{.name = f.text("name"),
                    .uri = f.text("uri"),
                    .mime = f.text("mimeType"),
                    .has_uri = f.has("uri"),
                    .view = f.index("bufferView", sizes.views)};
  if (image.has_uri == (image.view >= 0)) {
    f.findings().fail("image_source", "An image must have either a uri or a bufferView.", f.pointer());
  }
  return image;
}

std::vector<Texture> parse_textures(const Fields& root, const Sizes& sizes) {
  std::vector<Texture> samplers, out;
  root.for_each("samplers", [&](const Fields& f) {
    samplers.push_back({.wrap_u = parse_wrap(f, "wrapS"),
                        .wrap_v = parse_wrap(f, "wrapT"),
                        .nearest = f.count("magFilter", 9729) == 9728});
  });
  root.for_each("textures", [&](const Fields& f) {
    const int sampler = f.index("sampler", samplers.size());
    out.push_back(sampler >= 0 ? samplers[static_cast<std::size_t>(sampler)] : Texture{});
    out.back().image = parse_source(f, sizes);
  });
  return out;
}

Material parse_material(const Fields& f, const Sizes& sizes) {
  Material m;
  m.name = f.text("name");
  parse_metallic_roughness(f.object("pbrMetallicRoughness"), sizes, m);
  if (f.has_extension("KHR_materials_pbrSpecularGlossiness")) {
    parse_specular_glossiness(f.extension("KHR_materials_pbrSpecularGlossiness"), sizes, m);
  }
  m.emission = color3(f, "emissiveFactor", 0);
  if (f.has_extension("KHR_materials_emissive_strength")) {
    m.emission *= real(f.extension("KHR_materials_emissive_strength"), "emissiveStrength", 1);
  }
  if (m.emission.x < 0 || m.emission.y < 0 || m.emission.z < 0) {
    f.findings().fail("emission_negative", "Emission must not be negative.", f.pointer("emissiveFactor"));
  }
  m.emission_texture = parse_texture_ref(f, "emissiveTexture", sizes);
  m.normal_texture = parse_texture_ref(f, "normalTexture", sizes);
  m.alpha_mode = parse_alpha_mode(f);
  m.alpha_cutoff = real(f, "alphaCutoff", 0.5);
  m.double_sided = f.flag("doubleSided", false);
  m.unlit = f.has_extension("KHR_materials_unlit");
  return m;
}

Light parse_light(const Fields& f) {
  Light light;
  light.name = f.text("name");
  const std::string type = f.text("type");
  light.type = type == "directional" ? LightType::directional : type == "spot" ? LightType::spot : LightType::point;
  if (type != "directional" && type != "spot" && type != "point") {
    f.findings().fail("unknown_enum", "The light type is not known.", f.pointer("type"));
  }
  light.intensity = color3(f, "color", 1) * real(f, "intensity", 1);
  light.range = real(f, "range", 0);
  if (light.type == LightType::spot) {
    const Fields spot = f.object("spot");
    light.inner_cone = real(spot, "innerConeAngle", 0);
    light.outer_cone = real(spot, "outerConeAngle", 0.7853981633974483);
  }
  const Vec3f& i = light.intensity;
  if (i.x < 0 || i.y < 0 || i.z < 0)
    f.findings().fail("light_negative", "A light must not be negative.", f.pointer("intensity"));
  if (light.inner_cone < 0 || light.outer_cone > 1.5707964F || light.inner_cone > light.outer_cone) {
    f.findings().fail("light_cone", "Cone angles must satisfy 0 <= inner <= outer <= pi/2.", f.pointer("spot"));
  }
  return light;
}

}  // namespace kiln::gltf
