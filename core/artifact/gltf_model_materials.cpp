#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>

#include "core/artifact/gltf_model.h"

namespace kiln::gltf {
namespace {

using tinygltf::Value;

// check_tree has held every number here to 1e30.

float real_of(const Value& object, const char* name, double absent) {
  return static_cast<float>(number_of(object, name, absent));
}

/// An array of N numbers among the members of an extension.
template <std::size_t N>
std::array<float, N> reals_of(const Value& object, const char* name, std::array<float, N> absent) {
  const Value* array = find_member(object, name);
  if (!array || array->ArrayLen() != N) return absent;
  for (std::size_t i = 0; i < N; ++i) {
    absent[i] = static_cast<float>(array->Get(static_cast<int>(i)).GetNumberAsDouble());
  }
  return absent;
}

Vec3f vec3(const std::vector<double>& c, float absent) {
  if (c.size() != 3) return {absent, absent, absent};
  return {static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2])};
}

/// KHR_texture_transform: uv' = offset + R(rotation) (scale * uv), counter-clockwise with v running downwards.
void set_transform(const Value& extension, TextureRef& ref) {
  const auto offset = reals_of<2>(extension, "offset", {0, 0}), scale = reals_of<2>(extension, "scale", {1, 1});
  const float angle = real_of(extension, "rotation", 0), c = std::cos(angle), s = std::sin(angle);
  ref.transform = {c * scale[0], s * scale[1], offset[0], -s * scale[0], c * scale[1], offset[1]};
  ref.uv_set = static_cast<int>(number_of(extension, "texCoord", ref.uv_set));
}

/// `ref` has its texture and its own set of coordinates; the transform may name another.
TextureRef finished(TextureRef ref, const Value* transform, const std::string& place, Findings& findings) {
  if (transform) set_transform(*transform, ref);
  if (ref.uv_set > 1) {
    findings.warn("texture_uv_set_ignored", "Only TEXCOORD_0 and TEXCOORD_1 are read; the texture is left out.", place);
    ref.texture = -1;
    ref.uv_set = 0;
  }
  return ref;
}

template <class Info>
TextureRef convert_texture_info(const Info& info, const std::string& place, Findings& findings) {
  return finished({.texture = info.index, .uv_set = info.texCoord},
                  find_extension(info.extensions, "KHR_texture_transform"), place, findings);
}

/// One inside of an extension, where tinygltf knows no texture infos.
TextureRef texture_info_of(const Value& object, const char* name, const std::string& place, Findings& findings) {
  const Value* info = find_member(object, name);
  if (!info) return {};
  const Value* extensions = find_member(*info, "extensions");
  return finished({.texture = index_of(*info, "index"), .uv_set = static_cast<int>(number_of(*info, "texCoord", 0))},
                  extensions ? find_member(*extensions, "KHR_texture_transform") : nullptr, place + "/" + name,
                  findings);
}

void set_metallic_roughness(const tinygltf::PbrMetallicRoughness& pbr, const std::string& place, Material& m,
                            Findings& findings) {
  const auto c = [&](std::size_t i) { return static_cast<float>(pbr.baseColorFactor.at(i)); };
  m.base_color = {c(0), c(1), c(2), c(3)};
  m.base_color_texture = convert_texture_info(pbr.baseColorTexture, place + "/baseColorTexture", findings);
  m.metallic = static_cast<float>(pbr.metallicFactor);
  m.roughness = static_cast<float>(pbr.roughnessFactor);
  m.metallic_roughness_texture =
      convert_texture_info(pbr.metallicRoughnessTexture, place + "/metallicRoughnessTexture", findings);
}

void set_specular_glossiness(const Value& extension, const std::string& place, Material& m, Findings& findings) {
  const auto c = reals_of<4>(extension, "diffuseFactor", {1, 1, 1, 1});
  m.base_color = {c[0], c[1], c[2], c[3]};
  m.base_color_texture = texture_info_of(extension, "diffuseTexture", place, findings);
  m.metallic = 0;
  m.roughness = 1 - real_of(extension, "glossinessFactor", 1);
  m.metallic_roughness_texture = {};
}

Vec3f emission_of(const tinygltf::Material& material, const std::string& place, Findings& findings) {
  Vec3f emission = vec3(material.emissiveFactor, 0);
  const Value* strength = find_extension(material.extensions, "KHR_materials_emissive_strength");
  if (strength) emission *= real_of(*strength, "emissiveStrength", 1);
  if (emission.x < 0 || emission.y < 0 || emission.z < 0) {
    findings.fail("emission_negative", "Emission must not be negative.", place + "/emissiveFactor");
  }
  constexpr float kBrightest = 1e30F;  // sums over many lamps still fit a float
  if (std::max({emission.x, emission.y, emission.z}) > kBrightest) {
    findings.fail("light_out_of_range", "Emission is above 1e30.", place + "/emissiveFactor");
  }
  return emission;
}

Material convert_material(const tinygltf::Material& material, const std::string& place, Findings& findings) {
  Material m;
  m.name = material.name;
  set_metallic_roughness(material.pbrMetallicRoughness, place + "/pbrMetallicRoughness", m, findings);
  const Value* glossiness = find_extension(material.extensions, "KHR_materials_pbrSpecularGlossiness");
  if (glossiness) {
    set_specular_glossiness(*glossiness, place + "/extensions/KHR_materials_pbrSpecularGlossiness", m, findings);
  }
  m.emission = emission_of(material, place, findings);
  m.emission_texture = convert_texture_info(material.emissiveTexture, place + "/emissiveTexture", findings);
  m.normal_texture = convert_texture_info(material.normalTexture, place + "/normalTexture", findings);
  m.normal_texture.scale = static_cast<float>(material.normalTexture.scale);
  m.alpha_mode = material.alphaMode == "MASK"    ? AlphaMode::mask
                 : material.alphaMode == "BLEND" ? AlphaMode::blend
                                                 : AlphaMode::opaque;
  m.alpha_cutoff = static_cast<float>(material.alphaCutoff);
  m.double_sided = material.doubleSided;
  m.unlit = find_extension(material.extensions, "KHR_materials_unlit") != nullptr;
  return m;
}

Wrap convert_wrap(int code) {
  return code == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE     ? Wrap::clamp
         : code == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT ? Wrap::mirror
                                                         : Wrap::repeat;
}

/// The image of a texture: the core one, or else one of a format that is carried undecoded.
int image_of(const tinygltf::Texture& texture, const std::string& place, Findings& findings) {
  if (texture.source >= 0) return texture.source;
  for (const char* name : {"KHR_texture_basisu", "EXT_texture_webp", "EXT_texture_avif", "MSFT_texture_dds"}) {
    const Value* other = find_extension(texture.extensions, name);
    if (!other) continue;
    findings.warn("texture_not_decoded",
                  std::string("A texture has only the form of ") + name + "; it is baked as white.", place);
    return index_of(*other, "source");
  }
  return -1;
}

Texture convert_texture(const tinygltf::Model& model, const tinygltf::Texture& texture, const std::string& place,
                        Findings& findings) {
  Texture out;
  if (texture.sampler >= 0) {
    const auto& sampler = model.samplers.at(static_cast<std::size_t>(texture.sampler));
    out.wrap_u = convert_wrap(sampler.wrapS);
    out.wrap_v = convert_wrap(sampler.wrapT);
    out.nearest = sampler.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST;
  }
  out.image = image_of(texture, place, findings);
  return out;
}

void check_light(const Light& light, const std::string& place, Findings& findings) {
  const Vec3f& i = light.intensity;
  if (i.x < 0 || i.y < 0 || i.z < 0) {
    findings.fail("light_negative", "A light must not be negative.", place + "/intensity");
  }
  if (light.inner_cone < 0 || light.outer_cone > 1.5707964F || light.inner_cone > light.outer_cone) {
    findings.fail("light_cone", "Cone angles must satisfy 0 <= inner <= outer <= pi/2.", place + "/spot");
  }
}

Light convert_light(const tinygltf::Light& light) {
  Light out;
  out.name = light.name;
  out.type = light.type == "directional" ? LightType::directional
             : light.type == "spot"      ? LightType::spot
                                         : LightType::point;
  out.intensity = vec3(light.color, 1) * static_cast<float>(light.intensity);
  out.range = static_cast<float>(light.range);
  if (out.type == LightType::spot) {
    out.inner_cone = static_cast<float>(light.spot.innerConeAngle);
    out.outer_cone = static_cast<float>(light.spot.outerConeAngle);
  }
  return out;
}

std::string place_of(const char* array, std::size_t i) { return array + std::to_string(i); }

}  // namespace

void convert_materials(const tinygltf::Model& model, Document& out, Findings& findings) {
  for (const auto& texture : model.textures) {
    out.textures.push_back(convert_texture(model, texture, place_of("/textures/", out.textures.size()), findings));
  }
  for (const auto& material : model.materials) {
    out.materials.push_back(convert_material(material, place_of("/materials/", out.materials.size()), findings));
  }
  for (const auto& light : model.lights) {
    out.lights.push_back(convert_light(light));
    check_light(out.lights.back(), place_of("/extensions/KHR_lights_punctual/lights/", out.lights.size() - 1),
                findings);
  }
}

}  // namespace kiln::gltf
