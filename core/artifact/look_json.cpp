// Materials, textures and lights as glTF.

#include "core/artifact/look_json.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

namespace kiln {
namespace {

using json = nlohmann::ordered_json;
using Extensions = std::set<std::string>;

/// The double nearest to the shortest decimal that names this float: 0.1, not 0.10000000149011612.
double number(float x) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), x).ptr;
  double out = 0;
  std::from_chars(text.data(), end, out);
  return out;
}

/// glTF's factors lie in [0, 1], whatever the input said.
double factor(float x) { return number(std::clamp(x, 0.0F, 1.0F)); }

json rgb(const Vec3f& c) { return {number(c.x), number(c.y), number(c.z)}; }

/// Offset, rotation and scale of uv' = T R S uv with R = (c s; -s c), as KHR_texture_transform has it.
json transform_json(const std::array<float, 6>& m) {
  const double rotation = std::atan2(-static_cast<double>(m[3]), static_cast<double>(m[0]));
  const double c = std::cos(rotation), s = std::sin(rotation);
  const double scale_u = c * m[0] - s * m[3], scale_v = s * m[1] + c * m[4];
  return {{"offset", {number(m[2]), number(m[5])}}, {"rotation", rotation}, {"scale", {scale_u, scale_v}}};
}

json texture_info(const TextureRef& ref, Extensions& used) {
  json out{{"index", ref.texture}};
  if (ref.uv_set != 0) out["texCoord"] = ref.uv_set;
  if (ref.transform != TextureRef{}.transform) {
    out["extensions"]["KHR_texture_transform"] = transform_json(ref.transform);
    used.insert("KHR_texture_transform");
  }
  return out;
}

void put_alpha(const Material& m, json& out) {
  if (m.alpha_mode == AlphaMode::mask) {
    out["alphaMode"] = "MASK";
    out["alphaCutoff"] = number(std::max(m.alpha_cutoff, 0.0F));
  }
  if (m.alpha_mode == AlphaMode::blend) out["alphaMode"] = "BLEND";
  if (m.double_sided) out["doubleSided"] = true;
}

/// emissiveFactor may not pass 1: what is brighter goes to emissiveStrength.
void put_emission(const Material& m, json& out, Extensions& used) {
  const float peak = std::max({m.emission.x, m.emission.y, m.emission.z});
  if (peak > 1) {
    const double p = peak;
    out["emissiveFactor"] = {m.emission.x / p, m.emission.y / p, m.emission.z / p};
    out["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = number(peak);
    used.insert("KHR_materials_emissive_strength");
  } else if (peak > 0) {
    out["emissiveFactor"] = rgb(m.emission);
  }
  if (m.emission_texture.texture >= 0) out["emissiveTexture"] = texture_info(m.emission_texture, used);
}

json original_material(const Material& m, Extensions& used) {
  json out{{"name", m.name}};
  json& pbr = out["pbrMetallicRoughness"];
  pbr["baseColorFactor"] = {factor(m.base_color.x), factor(m.base_color.y), factor(m.base_color.z),
                            factor(m.base_color.w)};
  if (m.base_color_texture.texture >= 0) pbr["baseColorTexture"] = texture_info(m.base_color_texture, used);
  pbr["metallicFactor"] = factor(m.metallic);
  pbr["roughnessFactor"] = factor(m.roughness);
  if (m.metallic_roughness_texture.texture >= 0) {
    pbr["metallicRoughnessTexture"] = texture_info(m.metallic_roughness_texture, used);
  }
  if (m.normal_texture.texture >= 0) {
    out["normalTexture"] = texture_info(m.normal_texture, used);
    out["normalTexture"]["scale"] = number(m.normal_texture.scale);
  }
  put_emission(m, out, used);
  put_alpha(m, out);
  if (m.unlit) out["extensions"]["KHR_materials_unlit"] = json::object();
  return out;
}

json unlit_twin(const Material& m, Extensions& used) {
  json out{{"name", m.name + " (baked)"}};
  json& pbr = out["pbrMetallicRoughness"];
  pbr["baseColorFactor"] = {1, 1, 1, factor(m.base_color.w)};
  if (m.base_color_texture.texture >= 0) pbr["baseColorTexture"] = texture_info(m.base_color_texture, used);
  pbr["metallicFactor"] = 0;
  put_alpha(m, out);
  out["extensions"]["KHR_materials_unlit"] = json::object();
  used.insert("KHR_materials_unlit");
  return out;
}

json materials_json(const Scene& scene, Extensions& used) {
  json out = json::array();
  for (const Material& m : scene.materials) out.push_back(original_material(m, used));
  for (const Material& m : scene.materials) out.push_back(unlit_twin(m, used));
  return out;
}

int wrap_code(Wrap wrap) { return wrap == Wrap::clamp ? 33071 : wrap == Wrap::mirror ? 33648 : 10497; }

json sampler_json(const Texture& t) {
  return {{"magFilter", t.nearest ? 9728 : 9729},
          {"minFilter", t.nearest ? 9984 : 9987},
          {"wrapS", wrap_code(t.wrap_u)},
          {"wrapT", wrap_code(t.wrap_v)}};
}

/// Image types beyond the core format need an extension to be named by a texture.
const char* source_extension(const std::string& mime) {
  return mime == "image/webp" ? "EXT_texture_webp" : mime == "image/ktx2" ? "KHR_texture_basisu" : nullptr;
}

void put_textures(const Scene& scene, LookJson& out, Extensions& used) {
  json textures = json::array(), samplers = json::array();
  for (const Texture& t : scene.textures) {
    const json sampler = sampler_json(t);
    const auto known = std::ranges::find(samplers, sampler);
    json texture{{"sampler", known - samplers.begin()}};
    if (known == samplers.end()) samplers.push_back(sampler);
    if (t.image >= 0) {
      const char* extension = source_extension(scene.images[static_cast<std::size_t>(t.image)].mime);
      if (extension) used.insert(extension);
      (extension ? texture["extensions"][extension] : texture)["source"] = t.image;
    }
    textures.push_back(texture);
  }
  out.textures = textures.dump();
  out.samplers = samplers.dump();
}

/// Radiometric intensity back in world units, as a colour in [0, 1] times a number.
json light_json(const Light& light, double scale) {
  const float peak = std::max({light.intensity.x, light.intensity.y, light.intensity.z});
  const double p = peak > 0 ? peak : 1;
  const bool distant = light.type == LightType::directional;
  json out{{"name", light.name},
           {"type", distant                          ? "directional"
                    : light.type == LightType::point ? "point"
                                                     : "spot"},
           {"color", {light.intensity.x / p, light.intensity.y / p, light.intensity.z / p}},
           {"intensity", std::max(peak, 0.0F) * (distant ? 1 : scale * scale)}};
  if (!distant && light.range > 0) out["range"] = light.range * scale;
  if (light.type == LightType::spot) {
    const float outer = std::max(light.outer_cone, 1e-6F);  // glTF asks for 0 <= inner < outer
    out["spot"] = {{"innerConeAngle", number(std::min(light.inner_cone, outer * 0.999999F))},
                   {"outerConeAngle", number(outer)}};
  }
  return out;
}

/// The quaternion that turns -z, the way a glTF light shines, to `d`.
json light_rotation(const Vec3d& d) {
  double w = 1 - d.z;
  Vec3d axis = cross(Vec3d{0, 0, -1}, d);
  if (w < 1e-9) {
    w = 0;
    axis = {0, 1, 0};
  }
  const double norm = std::sqrt(dot(axis, axis) + w * w);
  return {axis.x / norm, axis.y / norm, axis.z / norm, w / norm};
}

void put_lights(const Scene& scene, LookJson& out, Extensions& used) {
  json lights = json::array(), nodes = json::array();
  for (const Light& light : scene.lights) {
    const Vec3d at = scene.frame.to_world(to_double(light.position));
    json node{{"name", light.name}, {"translation", {at.x, at.y, at.z}}};
    node["rotation"] = light_rotation(to_double(light.direction));
    node["extensions"]["KHR_lights_punctual"]["light"] = lights.size();
    nodes.push_back(node);
    lights.push_back(light_json(light, scene.frame.scale));
    used.insert("KHR_lights_punctual");
  }
  out.lights = lights.dump(-1, ' ', false, json::error_handler_t::replace);
  out.light_nodes = nodes.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace

LookJson look_json(const Scene& scene) {
  LookJson out;
  Extensions used;
  out.materials = materials_json(scene, used).dump(-1, ' ', false, json::error_handler_t::replace);
  put_textures(scene, out, used);
  put_lights(scene, out, used);
  out.extensions.assign(used.begin(), used.end());
  return out;
}

}  // namespace kiln
