#include <exception>

#include "core/artifact/findings.h"
#include "core/artifact/gltf_scene.h"
#include "core/artifact/import.h"
#include "core/artifact/ply_scene.h"
#include "core/base/expects.h"

namespace kiln {
namespace {

using gltf::Radiance;

constexpr std::uint64_t kMaxFileBytes = 0xFFFFFFFF;  // GLB holds its lengths in 32 bits

LitScene import_by_content(const SceneFiles& files, const ImportLimits& limits, Radiance radiance, Findings& findings) {
  const std::span<const std::uint8_t> main = files.main;
  if (main.empty()) {
    findings.fail("empty_file", "The file has no bytes.");
  } else if (main.size() > kMaxFileBytes) {
    findings.fail("file_too_large", "Files of 4 GiB and more are not read.");
  } else if (looks_like_glb(main)) {
    return gltf::import_gltf(open_glb(files.main, findings), {files, limits, radiance}, findings);
  } else if (looks_like_ply(main)) {
    return {import_ply(main, limits, findings), {}};
  } else if (looks_like_json(main)) {
    return gltf::import_gltf(open_gltf(main, findings), {files, limits, radiance}, findings);
  } else {
    findings.fail("unknown_format", "The file is not glTF 2.0, GLB or PLY.");
  }
  return {};
}

Result<LitScene> import_files(const SceneFiles& files, const ImportLimits& limits, Radiance radiance) {
  Findings findings(files.name);
  LitScene lit;
  try {
    lit = import_by_content(files, limits, radiance, findings);
  } catch (const ContractViolation&) {
    throw;  // our own mistake, not the file's
  } catch (const std::exception&) {
    findings.fail("out_of_memory", "The scene does not fit into the memory of this process.");
  }
  if (findings.failed()) return tl::make_unexpected(findings.fault());
  lit.scene.warnings = findings.warnings();
  return lit;
}

}  // namespace

Result<Scene> import_scene(const SceneFiles& files, const ImportLimits& limits) {
  KILN_TRY(lit, import_files(files, limits, Radiance::leave));
  return std::move(lit.scene);
}

Result<LitScene> import_lit_scene(const SceneFiles& files, const ImportLimits& limits) {
  return import_files(files, limits, Radiance::read);
}

}  // namespace kiln
