#include <algorithm>
#include <array>
#include <string_view>

#include "core/artifact/gltf_tree.h"

namespace kiln::gltf {
namespace {

constexpr std::array<std::string_view, 10> kHonoured{
    "KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_mesh_quantization",
    "KHR_texture_transform",      "KHR_lights_punctual",     "KHR_materials_emissive_strength",
    "KHR_materials_unlit",        "EXT_mesh_gpu_instancing", "KHR_materials_pbrSpecularGlossiness",
    "KILN_radiance_functions"};

/// Without effect on diffuse light, so not worth a word.
constexpr std::array<std::string_view, 4> kHarmless{"KHR_xmp_json_ld", "KHR_animation_pointer", "KHR_materials_ior",
                                                    "KHR_materials_specular"};

bool contains(const auto& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// Names come from the file: only what may stand in an extension's name is repeated.
std::string printable(const std::string& name) {
  std::string out = name.substr(0, 80);
  std::replace_if(
      out.begin(), out.end(),
      [](char c) { return !(('0' <= c && c <= '9') || ('A' <= c && c <= 'Z') || ('a' <= c && c <= 'z')); }, '_');
  return out;
}

}  // namespace

void check_extensions(const std::vector<std::string>& used, const std::vector<std::string>& required,
                      Findings& findings) {
  for (std::size_t i = 0; i < required.size(); ++i) {
    if (contains(kHonoured, required[i]) || contains(kHarmless, required[i])) continue;
    findings.fail("unsupported_extension", "The file requires " + printable(required[i]) + ", which is not supported.",
                  "/extensionsRequired/" + std::to_string(i));
  }
  for (const std::string& name : used) {
    if (name == "KHR_materials_pbrSpecularGlossiness") {
      findings.warn("specular_glossiness_as_diffuse",
                    "Specular-glossiness materials are baked by their diffuse colour.");
    }
    if (!contains(kHonoured, name) && !contains(kHarmless, name)) {
      findings.warn("extension_ignored", "The file uses " + printable(name) + ", which has no effect on the bake.");
    }
  }
}

}  // namespace kiln::gltf
