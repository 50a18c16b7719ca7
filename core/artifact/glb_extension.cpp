#include "core/artifact/glb_extension.h"

#include <nlohmann/json.hpp>

#include "core/artifact/gltf_container.h"
#include "core/artifact/gltf_load.h"
#include "core/artifact/json_scan.h"

namespace kiln {

void read_root_extension(std::span<const std::uint8_t> glb, const char* name, Findings& findings,
                         const ReadExtension& read) {
  const GltfContainer container = open_glb(glb, findings);
  if (findings.failed()) return;
  scan_json(container.json, {}, findings);
  if (findings.failed()) return;
  const nlohmann::json document = nlohmann::json::parse(container.json.begin(), container.json.end(), nullptr, false);
  if (document.is_discarded()) return findings.fail("json_invalid", "The text is not JSON.");
  const Fields root(document, "", findings);
  if (!root.has_extension(name)) return;
  const gltf::Document parsed = gltf::load_document(container.json, findings);
  if (findings.failed()) return;
  const gltf::BufferBytes bytes = gltf::load_bytes(parsed, container, {}, {}, findings);
  if (!findings.failed()) read(root.extension(name), bytes);
}

}  // namespace kiln
