#include "core/artifact/gltf_tree.h"

#include <nlohmann/json.hpp>

namespace kiln::gltf {
namespace {

using Json = nlohmann::json;

/// The member at the end of `path`, or nothing where there is none.
template <class AnyJson>
AnyJson* find(AnyJson& root, std::initializer_list<const char*> path) {
  AnyJson* value = &root;
  for (const char* name : path) {
    const auto at = value->find(name);  // the end in all that is not an object
    if (at == value->end()) return nullptr;
    value = &*at;
  }
  return value;
}

template <class Visit>
void for_each(Json& root, std::initializer_list<const char*> path, const Visit& visit) {
  Json* array = find(root, path);
  if (!array) return;
  for (Json& element : *array) visit(element);
}

std::string text_or_empty(const Json& object, const char* name) {
  const Json* text = find(object, {name});
  return text ? text->get<std::string>() : "";
}

// Before the check, so that a file of another version or kind is told by that and not by its first strange member.

void check_version(const Json& root, Findings& findings) {
  const Json* asset = find(root, {"asset"});
  const Json* version = find(root, {"asset", "version"});
  if (asset && !asset->is_object()) return;  // for check_tree to say
  const bool is_text = version && version->is_string();
  if (!version || (is_text && version->get_ref<const std::string&>().empty())) {
    findings.fail("asset_version_missing", "A glTF must say its version.", "/asset/version");
  } else if (is_text && version->get_ref<const std::string&>().substr(0, 2) != "2.") {
    findings.fail("unsupported_version", "Only glTF 2.x is read.", "/asset/version");
  }
}

/// Nothing unless the member is an array of strings.
std::vector<std::string> texts(const Json& root, const char* name) {
  std::vector<std::string> out;
  const Json* array = find(root, {name});
  if (!array || !array->is_array()) return out;
  for (const Json& text : *array) {
    if (!text.is_string()) return {};
    out.push_back(text.get<std::string>());
  }
  return out;
}

// After it: what tinygltf is not given.

/// tinygltf would open files, decode base64 up to its first bad character and copy the bytes of every buffer.
std::vector<Buffer> take_buffers(Json& root) {
  std::vector<Buffer> out;
  for_each(root, {"buffers"}, [&](const Json& buffer) {
    const Json* fallback = find(buffer, {"extensions", "EXT_meshopt_compression", "fallback"});
    out.push_back({.bytes = buffer.at("byteLength").get<std::uint64_t>(),
                   .uri = text_or_empty(buffer, "uri"),
                   .has_uri = buffer.contains("uri"),
                   .fallback = fallback && fallback->get<bool>()});
  });
  root.erase("buffers");
  return out;
}

std::vector<ImageSource> take_images(Json& root, Findings& findings) {
  std::vector<ImageSource> out;
  for_each(root, {"images"}, [&](const Json& image) {
    const Json* view = find(image, {"bufferView"});
    if (image.contains("uri") == (view != nullptr)) {
      findings.fail("image_source", "An image must have either a uri or a bufferView.",
                    "/images/" + std::to_string(out.size()));
    }
    out.push_back({.name = text_or_empty(image, "name"),
                   .uri = text_or_empty(image, "uri"),
                   .mime = text_or_empty(image, "mimeType"),
                   .has_uri = image.contains("uri"),
                   .view = view ? view->get<int>() : -1});
  });
  root.erase("images");
  return out;
}

RadianceDeclaration take_radiance(Json& root) {
  const Json* given = find(root, {"extensions", "KILN_radiance_functions"});
  if (!given) return {};
  const RadianceDeclaration out{
      .version = given->at("version").get<std::uint64_t>(),
      .basis = given->at("basis") == "sh" ? RadianceBasis::harmonics : RadianceBasis::polynomials,
      .degree = given->at("degree").get<std::uint64_t>(),
      .reflected = given->at("reflected").get<bool>()};
  root["extensions"].erase("KILN_radiance_functions");
  return out;
}

void set_aside(Json& object, const char* name) {
  object["extensions"][kSetAside][name] = object[name].get<double>();
  object.erase(name);
}

/// tinygltf refuses a file with a stride that is not a multiple of 4. Kiln reads it.
void set_strides_aside(Json& root) {
  for_each(root, {"bufferViews"}, [](Json& view) {
    const Json* stride = find(view, {"byteStride"});
    if (stride && (stride->get<std::uint64_t>() % 4 != 0 || *stride > 252)) set_aside(view, "byteStride");
  });
}

/// tinygltf refuses a file with indices that have no view: those of Draco, and zeros with sparse values.
void set_indices_aside(Json& root) {
  for_each(root, {"meshes"}, [&](Json& mesh) {
    for_each(mesh, {"primitives"}, [&](Json& primitive) {
      const Json* indices = find(primitive, {"indices"});
      if (!indices || root["accessors"][indices->get<std::size_t>()].contains("bufferView")) return;
      set_aside(primitive, "indices");
    });
  });
}

/// tinygltf refuses a file with a spot light that leaves its angles to their defaults.
void complete_spots(Json& root) {
  for_each(root, {"extensions", "KHR_lights_punctual", "lights"}, [](Json& light) {
    if (light["type"] == "spot" && !light.contains("spot")) light["spot"] = Json::object();
  });
}

}  // namespace

PreparedTree prepare_tree(std::span<const std::uint8_t> text, Findings& findings) {
  PreparedTree out;
  Json root = Json::parse(text.begin(), text.end(), nullptr, /*allow_exceptions=*/false);
  if (root.is_discarded()) findings.fail("json_invalid", "The JSON is not well-formed.");
  if (!findings.failed() && root.is_object()) {
    check_version(root, findings);
    check_extensions(texts(root, "extensionsUsed"), texts(root, "extensionsRequired"), findings);
  }
  if (!findings.failed()) check_tree(root, findings);
  if (findings.failed()) return out;
  out.buffers = take_buffers(root);
  out.images = take_images(root, findings);
  out.radiance = take_radiance(root);
  root.erase("skins");  // are not applied; that a node has one is all that matters
  set_strides_aside(root);
  set_indices_aside(root);
  complete_spots(root);
  out.text = root.dump();
  return out;
}

}  // namespace kiln::gltf
