#include <exception>

#include "core/artifact/findings.h"
#include "core/artifact/gltf_scene.h"
#include "core/artifact/import.h"
#include "core/artifact/ply_scene.h"
#include "core/base/expects.h"

namespace kiln {
namespace {

constexpr std::uint64_t kMaxFileBytes = 0xFFFFFFFF;  // GLB holds its lengths in 32 bits

Scene import_glb(const SceneFiles& files, const ImportLimits& limits, Findings& findings) {
  const GltfContainer container = open_glb(files.main, findings);
  return findings.failed() ? Scene{} : gltf::import_gltf(container, files, limits, findings);
}

Scene import_by_content(const SceneFiles& files, const ImportLimits& limits, Findings& findings) {
  const std::span<const std::uint8_t> main = files.main;
  if (main.empty()) {
    findings.fail("empty_file", "The file has no bytes.");
  } else if (main.size() > kMaxFileBytes) {
    findings.fail("file_too_large", "Files of 4 GiB and more are not read.");
  } else if (looks_like_glb(main)) {
    return import_glb(files, limits, findings);
  } else if (looks_like_ply(main)) {
    return import_ply(main, limits, findings);
  } else if (looks_like_json(main)) {
    return gltf::import_gltf(open_gltf(main, findings), files, limits, findings);
  } else {
    findings.fail("unknown_format", "The file is not glTF 2.0, GLB or PLY.");
  }
  return {};
}

}  // namespace

Result<Scene> import_scene(const SceneFiles& files, const ImportLimits& limits) {
  Findings findings(files.name);
  Scene scene;
  try {
    scene = import_by_content(files, limits, findings);
  } catch (const ContractViolation&) {
    throw;  // our own mistake, not the file's
  } catch (const std::exception&) {
    findings.fail("out_of_memory", "The scene does not fit into the memory of this process.");
  }
  if (findings.failed()) return tl::make_unexpected(findings.fault());
  scene.warnings = findings.warnings();
  return scene;
}

}  // namespace kiln
