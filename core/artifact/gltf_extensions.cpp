#include <algorithm>
#include <array>
#include <string_view>

#include "core/artifact/gltf_tree.h"

namespace kiln::gltf {
namespace {

constexpr std::array<std::string_view, 9> kHonoured{
    "KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_mesh_quantization",
    "KHR_texture_transform",      "KHR_lights_punctual",     "KHR_materials_emissive_strength",
    "KHR_materials_unlit",        "EXT_mesh_gpu_instancing", "KILN_radiance_functions"};

/// Without effect on light, so not worth a word.
constexpr std::array<std::string_view, 2> kHarmless{"KHR_xmp_json_ld", "KHR_animation_pointer"};

/// Read, but baked as something simpler.
struct Simplified {
  std::string_view name;
  const char *code, *message;
};
constexpr std::array<Simplified, 3> kSimplified{
    {{"KHR_materials_pbrSpecularGlossiness", "specular_glossiness_as_diffuse",
      "Specular-glossiness materials are baked by their diffuse colour."},
     {"KHR_materials_ior", "reflectance_ignored",
      "Dielectrics are baked with the reflectance 0.04 at normal incidence, whatever KHR_materials_ior says."},
     {"KHR_materials_specular", "reflectance_ignored",
      "Dielectrics are baked with the reflectance 0.04 at normal incidence, whatever KHR_materials_specular says."}}};

bool contains(const auto& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

const Simplified* simplified(const std::string& name) {
  const auto found = std::ranges::find(kSimplified, name, &Simplified::name);
  return found == kSimplified.end() ? nullptr : &*found;
}

bool accepted(const std::string& name) {
  return contains(kHonoured, name) || contains(kHarmless, name) || simplified(name) != nullptr;
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
    if (accepted(required[i])) continue;
    findings.fail("unsupported_extension", "The file requires " + printable(required[i]) + ", which is not supported.",
                  "/extensionsRequired/" + std::to_string(i));
  }
  for (const std::string& name : used) {
    if (const Simplified* known = simplified(name)) {
      findings.warn(known->code, known->message);
    } else if (!accepted(name)) {
      findings.warn("extension_ignored", "The file uses " + printable(name) + ", which has no effect on the bake.");
    }
  }
}

}  // namespace kiln::gltf
