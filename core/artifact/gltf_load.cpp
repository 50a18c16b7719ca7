#include "core/artifact/gltf_load.h"

#include <tiny_gltf.h>

#include <new>

#include "core/artifact/gltf_model.h"
#include "core/artifact/gltf_tree.h"

namespace kiln::gltf {
namespace {

/// tinygltf's own words stay here: they can name files and repeat what the file says.
bool parse(const std::string& text, tinygltf::Model& model) {
  std::string errors, warnings;
  try {
    return tinygltf::TinyGLTF().LoadASCIIFromString(&model, &errors, &warnings, text.data(),
                                                    static_cast<unsigned>(text.size()), /*base_dir=*/"");
  } catch (const std::bad_alloc&) {
    throw;  // import_scene says so
  } catch (const std::exception&) {
    return false;
  }
}

}  // namespace

Document load_document(std::span<const std::uint8_t> json, Findings& findings) {
  PreparedTree tree = prepare_tree(json, findings);
  if (findings.failed()) return {};
  tinygltf::Model model;
  if (!parse(tree.text, model)) {
    findings.fail("gltf_invalid", "The document cannot be read, although every member of it can.");
    return {};
  }
  Document document;
  document.buffers = std::move(tree.buffers);
  document.images = std::move(tree.images);
  convert_geometry(model, document, findings);
  convert_materials(model, document, findings);
  return document;
}

}  // namespace kiln::gltf
