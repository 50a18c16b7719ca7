#include "core/artifact/gltf_parse.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/artifact/gltf_parse_parts.h"

namespace kiln::gltf {
namespace {

void check_version(const Fields& root) {
  const std::string version = root.object("asset").text("version");
  if (root.findings().failed()) return;
  if (version.empty()) {
    root.findings().fail("asset_version_missing", "A glTF must say its version.", "/asset/version");
  } else if (version.substr(0, 2) != "2.") {
    root.findings().fail("unsupported_version", "Only glTF 2.x is read.", "/asset/version");
  }
}

Sizes sizes_of(const Fields& root) {
  Sizes s{.buffers = root.size("buffers"),
          .views = root.size("bufferViews"),
          .accessors = root.size("accessors"),
          .meshes = root.size("meshes"),
          .nodes = root.size("nodes"),
          .images = root.size("images"),
          .samplers = root.size("samplers"),
          .textures = root.size("textures"),
          .materials = root.size("materials"),
          .skins = root.size("skins")};
  if (root.has_extension("KHR_lights_punctual")) s.lights = root.extension("KHR_lights_punctual").size("lights");
  return s;
}

/// Nodes of the default scene; of scene 0 if none is named; without scenes all nodes that are nobody's children.
std::vector<int> roots_of(const Fields& root, const Document& document, const Sizes& sizes) {
  const std::size_t scenes = root.size("scenes");
  if (scenes > 0) {
    const int wanted = std::max(0, root.index("scene", scenes));
    std::vector<int> nodes;
    int at = 0;
    root.for_each("scenes", [&](const Fields& scene) {
      std::vector<int> these = scene.indices("nodes", sizes.nodes);
      if (at++ == wanted) nodes = std::move(these);
    });
    return nodes;
  }
  std::vector<bool> is_child(document.nodes.size());
  for (const Node& node : document.nodes) {
    for (const int child : node.children) is_child[static_cast<std::size_t>(child)] = true;
  }
  std::vector<int> nodes;
  for (std::size_t i = 0; i < is_child.size(); ++i) {
    if (!is_child[i]) nodes.push_back(static_cast<int>(i));
  }
  return nodes;
}

template <class T, class Parse>
std::vector<T> parse_all(const Fields& root, const char* key, const Parse& parse) {
  std::vector<T> out;
  out.reserve(root.size(key));
  root.for_each(key, [&](const Fields& fields) { out.push_back(parse(fields)); });
  return out;
}

Document parse_root(const Fields& root) {
  Document d;
  check_version(root);
  check_extensions(root, d);
  const Sizes sizes = sizes_of(root);
  d.buffers = parse_all<Buffer>(root, "buffers", parse_buffer);
  d.views = parse_all<BufferView>(root, "bufferViews", [&](const Fields& f) { return parse_view(f, sizes); });
  d.accessors = parse_all<Accessor>(root, "accessors", [&](const Fields& f) { return parse_accessor(f, sizes); });
  d.meshes = parse_all<Mesh>(root, "meshes", [&](const Fields& f) { return parse_mesh(f, sizes); });
  d.nodes = parse_all<Node>(root, "nodes", [&](const Fields& f) { return parse_node(f, sizes); });
  d.images = parse_all<ImageSource>(root, "images", [&](const Fields& f) { return parse_image(f, sizes); });
  d.textures = parse_textures(root, sizes);
  d.materials = parse_all<Material>(root, "materials", [&](const Fields& f) { return parse_material(f, sizes); });
  if (sizes.lights > 0) d.lights = parse_all<Light>(root.extension("KHR_lights_punctual"), "lights", parse_light);
  if (!root.findings().failed()) d.roots = roots_of(root, d, sizes);
  return d;
}

}  // namespace

Document parse_document(std::span<const std::uint8_t> text, Findings& findings) {
  const auto json = nlohmann::json::parse(text.begin(), text.end(), nullptr, /*allow_exceptions=*/false);
  if (json.is_discarded()) {
    findings.fail("json_invalid", "The JSON is not well-formed.");
    return {};
  }
  return parse_root(Fields(json, "", findings));
}

}  // namespace kiln::gltf
