#include "core/artifact/gltf_load.h"

#include <tiny_gltf.h>

#include <new>

#include "core/artifact/gltf_check.h"
#include "core/artifact/gltf_model.h"
#include "core/artifact/gltf_tree.h"

namespace kiln::gltf {
namespace {

/// tinygltf's own words stay here: they can name files and repeat what the file says.
bool parse(const std::string& text, tinygltf::Model& model) {
  std::string errors, warnings;
  return tinygltf::TinyGLTF().LoadASCIIFromString(&model, &errors, &warnings, text.data(),
                                                  static_cast<unsigned>(text.size()), /*base_dir=*/"");
}

Document load(PreparedTree tree, Findings& findings) {
  Document document{.buffers = std::move(tree.buffers), .images = std::move(tree.images), .radiance = tree.radiance};
  tinygltf::Model model;
  if (parse(tree.text, model)) {
    convert_geometry(model, document, findings);
    convert_materials(model, document, findings);
    if (findings.failed() || indices_hold(document)) return document;
  }
  findings.fail("gltf_invalid", "The document makes no sense, although each of its members does.");
  return {};
}

}  // namespace

Document load_document(std::span<const std::uint8_t> json, Findings& findings) {
  PreparedTree tree = prepare_tree(json, findings);
  if (findings.failed()) return {};
  try {
    return load(std::move(tree), findings);
  } catch (const std::bad_alloc&) {
    throw;  // import_scene says so
  } catch (const std::exception&) {
    findings.fail("gltf_invalid", "The document makes no sense, although each of its members does.");
    return {};
  }
}

}  // namespace kiln::gltf
