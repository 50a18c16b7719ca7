#include "core/artifact/progressive_glb.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/artifact/glb.h"
#include "core/artifact/glb_extension.h"

namespace kiln {
namespace {

constexpr const char* kName = "KILN_progressive_mesh";
constexpr const char* kPlace = "/extensions/KILN_progressive_mesh";

/// The extension's bytes; empty where there is none.
Bytes bytes_in(std::span<const std::uint8_t> file, Findings& findings) {
  Bytes out;
  read_root_extension(file, kName, findings, [&](const Fields& extension, const gltf::BufferBytes& bytes) {
    if (extension.count("version", 0) != 2)
      findings.fail("unsupported_version", "Only version 2 of the extension is read.", extension.pointer("version"));
    const int view = extension.index("bufferView", 1U << 30);
    if (view < 0 || static_cast<std::size_t>(view) >= bytes.views.size())
      return findings.fail("index_out_of_range", "There is no such buffer view.", extension.pointer("bufferView"));
    const auto found = bytes.views[static_cast<std::size_t>(view)];
    out.assign(found.begin(), found.end());
  });
  return out;
}

}  // namespace

Result<Bytes> add_progressive(std::span<const std::uint8_t> glb, std::span<const std::uint8_t> bytes) {
  KILN_TRY(chunks, split_glb(glb));
  auto document = nlohmann::ordered_json::parse(chunks.json);
  Bytes binary(chunks.binary.begin(), chunks.binary.end());
  binary.resize((binary.size() + 3) / 4 * 4, 0);
  auto& views = document["bufferViews"];
  views.push_back({{"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", bytes.size()}});
  binary.insert(binary.end(), bytes.begin(), bytes.end());
  document["extensions"][kName] = {{"version", 2}, {"bufferView", views.size() - 1}};
  auto& used = document["extensionsUsed"];
  used.push_back(kName);
  std::sort(used.begin(), used.end());
  document["buffers"][0]["byteLength"] = (binary.size() + 3) / 4 * 4;
  return join_glb(document.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace), std::move(binary));
}

Result<ProgressiveMesh> read_progressive(std::span<const std::uint8_t> glb) {
  Findings findings("scene.glb");
  const Bytes bytes = bytes_in(glb, findings);
  if (findings.failed()) return tl::make_unexpected(findings.fault());
  if (bytes.empty()) return ProgressiveMesh{};
  auto mesh = decode_progressive(bytes);
  if (!mesh) mesh.error().where = std::string("scene.glb: ") + kPlace + " " + mesh.error().where;
  return mesh;
}

}  // namespace kiln
