#include "core/artifact/carried_scene.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/artifact/assemble.h"
#include "core/artifact/baked_scene.h"
#include "core/artifact/gltf_images.h"
#include "core/artifact/gltf_load.h"
#include "core/artifact/gltf_primitive.h"
#include "core/artifact/gltf_scene.h"
#include "core/artifact/json_scan.h"
#include "core/lightfield/mean_radiance.h"

namespace kiln {
namespace {

/// The degree that a scene.glb declares, or -1 where the file is none. What is wrong with a file others say.
int declared_degree(const SceneFiles& files, const ImportLimits& limits) {
  Findings unheard("");
  if (!looks_like_glb(files.main)) return -1;
  const GltfContainer container = open_glb(files.main, unheard);
  if (!unheard.failed()) scan_json(container.json, {.max_bytes = limits.max_json_bytes}, unheard);
  if (unheard.failed()) return -1;
  const auto root = nlohmann::json::parse(container.json.begin(), container.json.end(), nullptr, false);
  const nlohmann::json::json_pointer place("/extensions/KILN_light_field");
  if (root.is_discarded() || !root.contains(place)) return -1;
  const nlohmann::json& extension = root[place];
  if (!extension.is_object() || !extension.contains("degree") || !extension["degree"].is_number_unsigned())
    return kMaxLightFieldDegree;
  return static_cast<int>(std::min(extension["degree"].get<std::uint64_t>(), std::uint64_t{kMaxLightFieldDegree}));
}

/// Before anything is decoded, from counts alone.
void check_size(const gltf::Document& document, int degree, const ImportLimits& limits, Findings& findings) {
  gltf::PrimitiveSize sum;
  for (const gltf::Mesh& mesh : document.meshes) {
    for (const gltf::Primitive& p : mesh.primitives) {
      if (!gltf::has_surface(p)) continue;
      const gltf::PrimitiveSize one = gltf::predicted_size(document, p);
      sum.vertices += one.vertices, sum.triangles += one.triangles;
    }
  }
  const auto row = 3 * sizeof(float) * static_cast<std::uint64_t>(sh_count(degree + 1));
  check_expanded_size(sum.vertices, sum.triangles, row, limits, findings);
}

/// The images of the file, each checked before it is decoded.
std::vector<Image> read_images(const SceneFiles& files, int degree, const ImportLimits& limits, Findings& findings) {
  const GltfContainer container = open_glb(files.main, findings);
  const gltf::Document document = gltf::load_document(container.json, findings);
  if (!findings.failed()) check_size(document, degree, limits, findings);
  if (findings.failed()) return {};
  const gltf::BufferBytes bytes = gltf::load_bytes(document, container, files, limits, findings);
  return findings.failed() ? std::vector<Image>{} : gltf::load_images(document, bytes, files, limits, findings);
}

Result<CarriedScene> read_own(const SceneFiles& files, int degree, const ImportLimits& limits) {
  Findings findings(files.name);
  std::vector<Image> images = read_images(files, degree, limits, findings);
  if (findings.failed()) return tl::make_unexpected(findings.fault());
  KILN_TRY(baked, read_baked_glb(files.main, files.name));
  if (baked.transfer.order != 0)
    return fault("not_a_baked_scene", "A light field stands beside a transfer of order 0.",
                 files.name + ": /extensions/KILN_radiance_transfer/order");
  baked.scene.images = std::move(images);
  return CarriedScene{std::move(baked.scene), std::move(baked.field), std::move(baked.transfer)};
}

/// Radiance has all colours in it: nothing may multiply it, and no seam of textures hold the mesh.
void keep_shape_alone(Scene& scene) {
  for (Material& m : scene.materials)
    m = {.name = std::move(m.name), .metallic = 0, .roughness = 1, .double_sided = m.double_sided};
  for (Part& part : scene.parts) part = {.name = std::move(part.name), .material = part.material};
  scene.images.clear(), scene.textures.clear();
  scene.mesh.uv0.clear(), scene.mesh.uv1.clear(), scene.mesh.color.clear(), scene.mesh.tangent.clear();
}

Transfer diffuse_of(const LightField& field, const Mesh& mesh) {
  Transfer out{0, 3, true, {}};
  for (const Vec3f& light : mean_radiance(field, mesh.normal))
    out.coefficients.insert(out.coefficients.end(), {light.x, light.y, light.z});
  return out;
}

}  // namespace

Result<CarriedScene> import_carried_scene(const SceneFiles& files, const ImportLimits& limits) {
  const int own = declared_degree(files, limits);
  if (own >= 0) return read_own(files, own, limits);
  KILN_TRY(lit, import_lit_scene(files, limits));
  CarriedScene out{std::move(lit.scene), std::move(lit.field), {}};
  if (!out.carries_light()) return out;
  keep_shape_alone(out.scene);
  out.diffuse = diffuse_of(out.field, out.scene.mesh);
  return out;
}

}  // namespace kiln
