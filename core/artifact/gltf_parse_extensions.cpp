#include <algorithm>
#include <array>
#include <string_view>

#include "core/artifact/gltf_parse_parts.h"

namespace kiln::gltf {
namespace {

constexpr std::array<std::string_view, 9> kHonoured{
    "KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_mesh_quantization",
    "KHR_texture_transform",      "KHR_lights_punctual",     "KHR_materials_emissive_strength",
    "KHR_materials_unlit",        "EXT_mesh_gpu_instancing", "KHR_materials_pbrSpecularGlossiness"};

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

void check_extensions(const Fields& root, Document& document) {
  Findings& findings = root.findings();
  int i = 0;
  for (const std::string& name : root.texts("extensionsRequired")) {
    if (!contains(kHonoured, name) && !contains(kHarmless, name)) {
      findings.fail("unsupported_extension", "The file requires " + printable(name) + ", which is not supported.",
                    "/extensionsRequired/" + std::to_string(i));
    }
    ++i;
  }
  for (const std::string& name : root.texts("extensionsUsed")) {
    if (name == "KHR_mesh_quantization") document.declares_quantization = true;
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
