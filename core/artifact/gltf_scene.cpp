#include "core/artifact/gltf_scene.h"

#include <algorithm>

#include "core/artifact/assemble.h"
#include "core/artifact/gltf_check.h"
#include "core/artifact/gltf_images.h"
#include "core/artifact/gltf_load.h"
#include "core/artifact/gltf_placement.h"
#include "core/artifact/gltf_primitive.h"
#include "core/artifact/gltf_radiance.h"
#include "core/artifact/json_scan.h"

namespace kiln::gltf {
namespace {

std::string primitive_place(std::size_t mesh, std::size_t primitive) {
  return "/meshes/" + std::to_string(mesh) + "/primitives/" + std::to_string(primitive);
}

void warn_of_rest_pose(const Document& d, Findings& findings) {
  const auto skinned = std::find_if(d.nodes.begin(), d.nodes.end(), [](const Node& n) { return n.skinned; });
  if (skinned != d.nodes.end()) {
    findings.warn("skin_rest_pose", "Skins are not applied; skinned meshes are baked as they lie in the file.",
                  "/nodes/" + std::to_string(skinned - d.nodes.begin()) + "/skin");
  }
  for (std::size_t m = 0; m < d.meshes.size(); ++m) {
    const auto& primitives = d.meshes[m].primitives;
    if (std::any_of(primitives.begin(), primitives.end(), [](const Primitive& p) { return p.morphed; })) {
      findings.warn("morph_rest_pose", "Morph targets are not applied; the mesh is baked in its rest pose.",
                    "/meshes/" + std::to_string(m));
    }
  }
}

/// Not where the file brings its light along: then nothing falls on its materials.
void warn_of_unlit(const Document& d, const std::vector<RawPart>& parts, Findings& findings) {
  const auto unlit = [&](const RawPart& p) {
    return p.material >= 0 && d.materials[static_cast<std::size_t>(p.material)].unlit;
  };
  const auto found = std::find_if(parts.begin(), parts.end(), unlit);
  if (d.radiance || found == parts.end()) return;
  findings.warn("unlit_as_diffuse",
                "Unlit materials are baked like others: light falls on them, and they reflect their base colour of it.",
                "/materials/" + std::to_string(found->material));
}

/// For a scene in which no primitive with surface stands.
std::string why_empty(const Document& d) {
  bool surface = false, any = false;
  for (const Mesh& mesh : d.meshes) {
    for (const Primitive& p : mesh.primitives) {
      any = true;
      surface |= has_surface(p);
    }
  }
  if (surface) return "No node of the default scene has a mesh with triangles.";
  return any ? "The meshes have only points and lines, or no positions: there is no surface to bake."
             : "The file has no mesh.";
}

/// Cleaned parts of each mesh that stands somewhere.
struct Parts {
  std::vector<RawPart> parts;
  std::vector<std::vector<std::size_t>> of_mesh;
};

void warn_of_no_surface(const Primitive& p, const std::string& place, Findings& findings) {
  if (p.attribute("POSITION") < 0) {
    findings.warn("primitive_without_positions", "A primitive without POSITION is left out.", place);
  } else {
    findings.warn("primitive_without_surface", "Points and lines cannot carry light; left out.", place);
  }
}

Parts read_parts(const AccessorSource& source, const std::vector<Placement>& placements, Findings& findings) {
  const Document& d = source.document;
  Parts out{.parts = {}, .of_mesh = std::vector<std::vector<std::size_t>>(d.meshes.size())};
  std::vector<bool> wanted(d.meshes.size());
  for (const Placement& placement : placements) wanted[static_cast<std::size_t>(placement.mesh)] = true;
  for (std::size_t m = 0; m < d.meshes.size() && !findings.failed(); ++m) {
    for (std::size_t p = 0; p < d.meshes[m].primitives.size() && !findings.failed(); ++p) {
      const Primitive& primitive = d.meshes[m].primitives[p];
      if (!has_surface(primitive)) warn_of_no_surface(primitive, primitive_place(m, p), findings);
      if (!has_surface(primitive) || !wanted[m]) continue;
      RawPart part = read_primitive(source, primitive, primitive_place(m, p), findings);
      if (d.radiance && !findings.failed()) read_radiance(source, primitive, part, findings);
      if (findings.failed()) break;
      clean_part(part, MissingNormals::flat, findings);
      out.of_mesh[m].push_back(out.parts.size());
      out.parts.push_back(std::move(part));
    }
  }
  return out;
}

/// Primitives of meshes that no node places are read too, for their faults alone, as long as that costs little.
void check_unplaced(const AccessorSource& source, const std::vector<Placement>& placements, Findings& findings) {
  constexpr std::uint64_t kMostTriangles = 1'000'000;
  const Document& d = source.document;
  std::vector<bool> placed(d.meshes.size());
  for (const Placement& placement : placements) placed[static_cast<std::size_t>(placement.mesh)] = true;
  std::uint64_t triangles = 0;
  for (std::size_t m = 0; m < d.meshes.size(); ++m) {
    for (std::size_t p = 0; p < d.meshes[m].primitives.size() && !placed[m] && !findings.failed(); ++p) {
      const Primitive& primitive = d.meshes[m].primitives[p];
      if (!has_surface(primitive)) continue;
      const PrimitiveSize size = predicted_size(d, primitive);
      triangles += size.triangles + size.vertices;
      if (triangles > kMostTriangles) return;
      read_primitive(source, primitive, primitive_place(m, p), findings);
    }
  }
}

std::vector<PlacedPart> place_parts(const Document& d, Parts& parts, std::vector<Placement>& placements) {
  std::vector<PlacedPart> out;
  for (Placement& placement : placements) {
    const Node& node = d.nodes[static_cast<std::size_t>(placement.node)];
    const Mesh& mesh = d.meshes[static_cast<std::size_t>(placement.mesh)];
    const std::string base = !node.name.empty()   ? node.name
                             : !mesh.name.empty() ? mesh.name
                                                  : "node " + std::to_string(placement.node);
    const auto& of_mesh = parts.of_mesh[static_cast<std::size_t>(placement.mesh)];
    for (std::size_t i = 0; i < of_mesh.size(); ++i) {
      out.push_back({.part = of_mesh[i],
                     .name = i == 0 ? base : base + "." + std::to_string(i),
                     .instances = placement.instances});
    }
  }
  return out;
}

/// Primitives without a material share one default, made only when it is needed.
void add_default_material(Scene& scene, std::vector<RawPart>& parts) {
  bool used = false;
  for (RawPart& part : parts) {
    if (part.material >= 0) continue;
    part.material = static_cast<int>(scene.materials.size());
    used = true;
  }
  if (used || scene.materials.empty()) scene.materials.push_back({.name = "default"});
}

std::vector<Light> lights_in_unit_lengths(const std::vector<PlacedLight>& lights, const Frame& frame) {
  std::vector<Light> out;
  for (const PlacedLight& placed : lights) {
    Light light = placed.light;
    light.position = to_float(frame.to_unit(placed.position));
    light.range = static_cast<float>(light.range / frame.scale);
    if (light.type != LightType::directional)
      light.intensity = to_float(to_double(light.intensity) / (frame.scale * frame.scale));
    out.push_back(light);
  }
  return out;
}

/// Rays may start 2e-6 from a point light: what reaches them, and sums over lights, must fit a float.
void check_lights(const std::vector<Light>& lights, Findings& findings) {
  constexpr float kBrightest = 1e30F, kBrightestPoint = 1e24F;
  for (const Light& light : lights) {
    const float most = light.type == LightType::directional ? kBrightest : kBrightestPoint;
    const auto& [x, y, z] = light.intensity;
    if (is_finite(light.position) && x <= most && y <= most && z <= most) continue;
    findings.fail("light_out_of_range", "A light is too far or too bright beside the size of the scene.",
                  "/extensions/KHR_lights_punctual");
  }
}

}  // namespace

LitScene import_gltf(const GltfContainer& container, const GltfImport& in, Findings& findings) {
  LitScene lit;
  Scene& scene = lit.scene;
  const ImportLimits& limits = in.limits;
  if (findings.failed()) return lit;
  scan_json(container.json,
            {.max_bytes = limits.max_json_bytes, .max_depth = limits.max_json_depth, .max_objects = limits.max_objects},
            findings);
  if (findings.failed()) return lit;
  Document document = load_document(container.json, findings);
  if (findings.failed()) return lit;
  if (document.radiance && in.radiance == Radiance::leave) {
    warn_of_unused_radiance(findings);
    document.radiance = {};
  } else {
    check_declaration(document, findings);
  }
  const BufferBytes bytes = load_bytes(document, container, in.files, limits, findings);
  if (!findings.failed()) check_document(document, findings);
  if (findings.failed()) return lit;
  const AccessorSource source{document, bytes};
  Placements placements = place_nodes(source, limits, findings);
  if (!findings.failed() && document.radiance) check_turns(placements.meshes, findings);
  if (!findings.failed()) check_unplaced(source, placements.meshes, findings);
  Parts parts = read_parts(source, placements.meshes, findings);
  if (findings.failed()) return lit;
  scene.materials = document.materials;
  scene.textures = document.textures;
  scene.images = load_images(document, bytes, in.files, limits, findings);
  if (parts.parts.empty()) findings.fail("empty_scene", why_empty(document));
  warn_of_unlit(document, parts.parts, findings);
  add_default_material(scene, parts.parts);
  if (findings.failed()) return lit;
  lit.field.degree = static_cast<int>(document.radiance.degree);
  assemble(parts.parts, place_parts(document, parts, placements.meshes), limits, lit, findings);
  if (findings.failed()) return lit;
  scene.lights = lights_in_unit_lengths(placements.lights, scene.frame);
  check_lights(scene.lights, findings);
  warn_of_rest_pose(document, findings);
  return lit;
}

}  // namespace kiln::gltf
