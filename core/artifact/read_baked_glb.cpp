// scene.glb -> BakedScene: as a viewer decodes it, but every index, count and number is checked first.

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/artifact/baked_header.h"
#include "core/artifact/baked_scene.h"
#include "core/artifact/draco_codec.h"
#include "core/artifact/gltf_bytes.h"
#include "core/artifact/gltf_check.h"
#include "core/artifact/gltf_container.h"
#include "core/artifact/gltf_load.h"
#include "core/artifact/image_decode.h"
#include "core/artifact/json_scan.h"

namespace kiln {
namespace {

constexpr float kCubeHalf = 0.5F + 1e-5F;    // quantised corners may round outwards by a step of float
constexpr float kUnitTolerance = 0.01F;      // octahedral decoding leaves unit vectors to within 1e-3 at 8 bits
constexpr double kRotationTolerance = 1e-6;  // a baked node is turned by nothing: only scaled and moved

/// Everything the parts are read from.
struct BakedFile {
  const gltf::Document& document;
  const gltf::BufferBytes& bytes;
  const BakedHeader& header;
  const LobeTable& lobes;
  const SkyLevels& sky;
};

std::string primitive_place(std::size_t mesh, std::size_t i) {
  return "/meshes/" + std::to_string(mesh) + "/primitives/" + std::to_string(i);
}

/// Moves one decoded stream of `components` floats to the end of a mesh array. Fails unless it is there and finite.
class StreamReader {
 public:
  StreamReader(DecodedMesh decoded, const gltf::DracoData& draco, std::string place, Findings& findings)
      : decoded_(std::move(decoded)), draco_(draco), place_(std::move(place)), findings_(findings) {}

  bool has(const std::string& name) const { return draco_.attributes.contains(name); }

  /// The floats of an attribute; zeros of the right number after a fault.
  std::vector<float> take(const std::string& name, int components) { return take_id(id_of(name), name, components); }

  std::vector<float> take_id(int id, const std::string& name, int components) {
    const auto found = decoded_.streams.find(static_cast<std::uint32_t>(id));
    const std::size_t floats = static_cast<std::size_t>(components) * decoded_.vertices;
    if (id < 0 || found == decoded_.streams.end() || found->second.values.size() != floats) {
      findings_.fail("attribute_missing", "The compressed geometry lacks the attribute.",
                     place_ + "/attributes/" + name);
      return std::vector<float>(floats, 0.0F);
    }
    check_finite(found->second.values, name);
    return found->second.values;
  }

 private:
  int id_of(const std::string& name) const {
    const auto at = draco_.attributes.find(name);
    return at == draco_.attributes.end() ? -1 : at->second;
  }

  void check_finite(const std::vector<float>& values, const std::string& name) {
    const auto bad = std::ranges::find_if(values, [](float v) { return !std::isfinite(v); });
    if (bad == values.end()) return;
    findings_.fail("non_finite_geometry", "Float " + std::to_string(bad - values.begin()) + " is not finite.",
                   place_ + "/attributes/" + name);
  }

  DecodedMesh decoded_;
  const gltf::DracoData& draco_;
  std::string place_;
  Findings& findings_;
};

void append(std::vector<Vec2f>& out, const std::vector<float>& f) {
  for (std::size_t i = 0; i + 1 < f.size(); i += 2) out.push_back({f[i], f[i + 1]});
}
void append(std::vector<Vec3f>& out, const std::vector<float>& f) {
  for (std::size_t i = 0; i + 2 < f.size(); i += 3) out.push_back({f[i], f[i + 1], f[i + 2]});
}
void append(std::vector<Vec4f>& out, const std::vector<float>& f) {
  for (std::size_t i = 0; i + 3 < f.size(); i += 4) out.push_back({f[i], f[i + 1], f[i + 2], f[i + 3]});
}

/// Decodes primitive `i` of mesh 0 within what its accessors promise.
DecodedMesh decode_part(const BakedFile& file, std::size_t i, Findings& findings) {
  const gltf::Primitive& p = file.document.meshes[0].primitives[i];
  const std::string place = primitive_place(0, i);
  const int position = p.attribute("POSITION");
  if (p.draco.view < 0 || position < 0 || p.indices < 0 || p.mode != gltf::Mode::triangles) {
    findings.fail("not_a_baked_scene", "A baked primitive is an indexed, Draco-compressed triangle list.", place);
    return {};
  }
  const std::uint64_t vertices = file.document.accessors[static_cast<std::size_t>(position)].count;
  const std::uint64_t indices = file.document.accessors[static_cast<std::size_t>(p.indices)].count;
  auto decoded = decode_draco(file.bytes.views[static_cast<std::size_t>(p.draco.view)], {vertices, indices / 3});
  if (!decoded) {
    findings.fail(decoded.error().code, decoded.error().message, place);
    return {};
  }
  if (decoded->vertices != vertices || decoded->triangles.size() * 3 != indices) {
    findings.fail("accessor_count_mismatch", "The compressed geometry has other counts than its accessors.", place);
  }
  return std::move(*decoded);
}

/// COLOR_0 of the original scene lies in the same compressed bytes, under the id that scene's primitive names.
int original_color_id(const BakedFile& file, std::size_t i) {
  const gltf::DracoData& draco = file.document.meshes[1].primitives[i].draco;
  const auto at = draco.attributes.find("COLOR_0");
  return at == draco.attributes.end() ? -1 : at->second;
}

/// An optional vertex array: values of this part, zeros for the parts before it that have none.
template <class T>
void append_optional(std::vector<T>& out, std::size_t first, const std::vector<float>& values) {
  out.resize(first);
  append(out, values);
}

void check_geometry(const Mesh& mesh, std::size_t first, const std::string& place, Findings& findings) {
  for (std::size_t v = first; v < mesh.position.size(); ++v) {
    const Vec3f& p = mesh.position[v];
    if (std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) > kCubeHalf) {
      findings.fail("position_out_of_cube", "Vertex " + std::to_string(v - first) + " is outside the unit cube.",
                    place);
    }
    if (std::abs(length(mesh.normal[v]) - 1) > kUnitTolerance) {
      findings.fail("normal_not_unit", "The normal of vertex " + std::to_string(v - first) + " has not length 1.",
                    place);
    }
    if (findings.failed()) return;
  }
}

/// Vectors of one shape, stored in one form under `name(k)`.
template <class Name>
void read_coefficients(const StoredForm& form, StreamReader& streams, const Name& name, std::size_t first,
                       std::size_t vertices, Transfer& out) {
  const std::size_t count = form.count();
  std::vector<float> numbers(vertices * count);
  for (std::size_t k = 0; k < vec4s_of(count); ++k) {
    const std::vector<float> stored = streams.take(name(k), 4);
    for (std::size_t j = 4 * k; j < std::min(4 * k + 4, count); ++j) {
      for (std::size_t v = 0; v < vertices; ++v)
        numbers[v * count + j] =
            static_cast<float>(form.offset[j] + form.scale[j] * static_cast<double>(stored[4 * v + j - 4 * k]));
    }
  }
  out.coefficients.resize((first + vertices) * out.stride());
  for (std::size_t v = 0; v < vertices; ++v)
    slots_of(form, out, &numbers[v * count], &out.coefficients[(first + v) * out.stride()]);
}

/// Weights of the part's matrices, and which vertices they belong to.
void read_matrices(const BakedFile& file, StreamReader& streams, std::size_t first, std::size_t vertices,
                   GlossyTransfer& out) {
  const StoredForm& form = file.header.glossy_form;
  const std::size_t rank = out.rank(), before = out.vertices.size();
  for (std::size_t v = 0; v < vertices; ++v) out.vertices.push_back(static_cast<std::uint32_t>(first + v));
  out.weights.resize(out.vertices.size() * rank);
  for (std::size_t k = 0; k < vec4s_of(rank); ++k) {
    const std::vector<float> stored = streams.take(glossy_name(k), 4);
    for (std::size_t j = 4 * k; j < std::min(4 * k + 4, rank); ++j) {
      for (std::size_t v = 0; v < vertices; ++v)
        out.weights[(before + v) * rank + j] =
            static_cast<float>(form.offset[j] + form.scale[j] * static_cast<double>(stored[4 * v + j - 4 * k]));
    }
  }
}

/// The stored numbers of a light field.
struct FieldNumbers {
  Transfer series, visibility, lamps;
};

void read_part(const BakedFile& file, std::size_t i, BakedScene& out, FieldNumbers& field, Findings& findings) {
  DecodedMesh decoded = decode_part(file, i, findings);
  if (findings.failed()) return;
  Mesh& mesh = out.scene.mesh;
  const std::size_t first = mesh.position.size(), vertices = decoded.vertices;
  for (const Triangle& t : decoded.triangles) {
    const auto base = static_cast<std::uint32_t>(first);
    mesh.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
    mesh.part.push_back(static_cast<std::uint32_t>(i));
  }
  const std::string place = primitive_place(0, i);
  StreamReader streams(std::move(decoded), file.document.meshes[0].primitives[i].draco, place, findings);
  const int color = original_color_id(file, i);
  const auto& header = file.header.parts[i];
  const Part part{header.name, header.material,       streams.has("TEXCOORD_0"), streams.has("TEXCOORD_1"),
                  color >= 0,  streams.has("TANGENT")};
  append(mesh.position, streams.take("POSITION", 3));
  append(mesh.normal, streams.take("NORMAL", 3));
  if (part.has_uv0) append_optional(mesh.uv0, first, streams.take("TEXCOORD_0", 2));
  if (part.has_uv1) append_optional(mesh.uv1, first, streams.take("TEXCOORD_1", 2));
  if (part.has_tangent) append_optional(mesh.tangent, first, streams.take("TANGENT", 4));
  if (part.has_color) append_optional(mesh.color, first, streams.take_id(color, "COLOR_0", 4));
  const BakedHeader& h = file.header;
  read_coefficients(
      h.form, streams, [&](std::size_t k) { return stored_name(h.shape, k); }, first, vertices, out.transfer);
  if (h.has_field) read_coefficients(h.field_form, streams, field_name, first, vertices, field.series);
  if (h.sky) read_coefficients(h.sky->form, streams, sky_name, first, vertices, field.visibility);
  if (!h.lamps.empty()) read_coefficients(h.lamp_form, streams, lamp_name, first, vertices, field.lamps);
  if (header.glossy) read_matrices(file, streams, first, vertices, out.glossy);
  check_geometry(mesh, first, place, findings);
  out.scene.parts.push_back(part);
}

/// Optional arrays either cover all vertices or are empty.
void fill_optional(Mesh& mesh) {
  const std::size_t n = mesh.position.size();
  if (!mesh.uv0.empty()) mesh.uv0.resize(n);
  if (!mesh.uv1.empty()) mesh.uv1.resize(n);
  if (!mesh.color.empty()) mesh.color.resize(n, {1, 1, 1, 1});
  if (!mesh.tangent.empty()) mesh.tangent.resize(n, {1, 0, 0, 1});
}

Frame read_frame(const gltf::Document& document, Findings& findings) {
  const auto& m = document.nodes[static_cast<std::size_t>(document.roots[0])].matrix;
  const double scale = m[0];
  double off = 0;
  for (const std::size_t i : {1u, 2u, 4u, 6u, 8u, 9u}) off = std::max(off, std::abs(m[i]));
  off = std::max({off, std::abs(m[5] - scale), std::abs(m[10] - scale)});
  if (!(scale > 0) || !(off <= kRotationTolerance * scale) || !std::isfinite(scale)) {
    findings.fail("not_a_baked_scene", "The baked node must be moved and scaled evenly, nothing else.", "/nodes/0");
  }
  return {{m[12], m[13], m[14]}, scale};
}

/// A light of the second scene, back in unit-cube lengths.
Light unit_light(const gltf::Document& document, const gltf::Node& node, const Frame& frame) {
  Light light = document.lights[static_cast<std::size_t>(node.light)];
  const auto& m = node.matrix;
  const double scale = frame.scale;
  light.position = to_float(frame.to_unit({m[12], m[13], m[14]}));
  light.direction = to_float(normalized(Vec3d{-m[8], -m[9], -m[10]}));
  if (light.type != LightType::directional) {
    light.intensity = to_float(to_double(light.intensity) / (scale * scale));
    light.range = static_cast<float>(light.range / scale);
  }
  return light;
}

/// Each scene has materials of its own: the originals, their unlit twins, and with a lightmap (lightmap_file.h) twins
/// that carry it.
std::size_t original_materials(const gltf::Document& d) {
  return d.materials.size() / std::max<std::size_t>(2, d.meshes.size());
}

void read_look(const BakedFile& file, Scene& scene) {
  const gltf::Document& d = file.document;
  const auto originals = static_cast<std::ptrdiff_t>(original_materials(d));
  scene.materials.assign(d.materials.begin(), d.materials.begin() + originals);
  scene.textures = d.textures;
  for (const gltf::ImageSource& image : d.images) {
    Image out{image.name, image.mime, {}, 0, 0, {}};
    if (image.view >= 0) {
      const auto bytes = file.bytes.views[static_cast<std::size_t>(image.view)];
      out.encoded.assign(bytes.begin(), bytes.end());
    }
    scene.images.push_back(std::move(out));
  }
  for (const gltf::Node& node : d.nodes) {
    if (node.light >= 0) scene.lights.push_back(unit_light(d, node, scene.frame));
  }
}

/// The two scenes mirror each other, and every part names an original material.
void check_shape(const gltf::Document& d, const BakedHeader& header, Findings& findings) {
  const bool mirrored = (d.meshes.size() == 2 || d.meshes.size() == 3) && d.roots.size() == 1 &&
                        !d.meshes[0].primitives.empty() &&
                        d.meshes[0].primitives.size() == d.meshes[1].primitives.size() &&
                        d.meshes[0].primitives.size() == header.parts.size();
  const bool any_matrix = std::ranges::any_of(header.parts, [](const auto& part) { return part.glossy; });
  if (any_matrix != bool{header.glossy})
    findings.fail("not_a_baked_scene", "Parts with matrices and the root's description of them go together.");
  if (!mirrored)
    findings.fail("not_a_baked_scene",
                  "A baked scene has two meshes with one primitive for each part, and one more with a lightmap.");
  for (std::size_t i = 0; i < header.parts.size(); ++i) {
    const int material = header.parts[i].material;
    if (material >= 0 && static_cast<std::size_t>(material) < original_materials(d)) continue;
    findings.fail("index_out_of_range", "The part names a material that is not there.", primitive_place(0, i));
  }
}

BakedScene read_scene(const BakedFile& file, Findings& findings) {
  BakedScene out;
  out.transfer = file.header.shape;
  out.glossy = file.header.glossy;
  out.lobes = file.lobes;
  out.light = file.header.light;
  out.exposure = file.header.exposure;
  out.provenance = file.header.provenance;
  out.scene.frame = read_frame(file.document, findings);
  FieldNumbers field{file.header.field_shape, visibility_shape(), lamp_shape(file.header.lamps.size())};
  for (std::size_t i = 0; i < file.header.parts.size() && !findings.failed(); ++i)
    read_part(file, i, out, field, findings);
  if (findings.failed()) return out;
  fill_optional(out.scene.mesh);
  out.field = {.degree = std::max(0, field.series.order - 1),
               .coefficients = std::move(field.series.coefficients),
               .visibility = std::move(field.visibility.coefficients),
               .sky = {},
               .lamps = file.header.lamps,
               .lamp_visibility = std::move(field.lamps.coefficients),
               .emission_apart = file.header.emission_apart,
               .diffuse = {},
               .diffuse_color = file.header.diffuse_color.value_or(Vec3f{})};
  if (file.header.diffuse_color) out.field.diffuse = out.transfer.coefficients;
  if (file.header.sky) {
    out.field.sky = file.header.sky->mean;
    out.field.sky_slope = static_cast<float>(file.header.sky->slope);
  }
  out.sky = file.sky;
  const auto finite = [](float c) { return std::isfinite(c); };
  if (!std::ranges::all_of(out.transfer.coefficients, finite) || !std::ranges::all_of(out.field.coefficients, finite) ||
      !std::ranges::all_of(out.field.visibility, finite) || !std::ranges::all_of(out.field.lamp_visibility, finite)) {
    findings.fail("number_out_of_range", "A coefficient does not fit a float.");
  }
  if (!std::ranges::all_of(out.glossy.weights, [](float w) { return std::isfinite(w); }))
    findings.fail("number_out_of_range", "A weight of a matrix does not fit a float.");
  read_look(file, out.scene);
  return out;
}

/// Fills `out` from a buffer view of just that many finite floats.
void read_floats(const gltf::BufferBytes& bytes, int index, const std::string& place, std::vector<float>& out,
                 Findings& findings) {
  const auto view = static_cast<std::size_t>(index);
  if (index < 0 || view >= bytes.views.size() || bytes.views[view].size() != out.size() * sizeof(float)) {
    findings.fail("slot_count_mismatch", "The buffer view does not hold just these numbers.", place);
    return;
  }
  std::memcpy(out.data(), bytes.views[view].data(), out.size() * sizeof(float));
  if (!std::ranges::all_of(out, [](float x) { return std::isfinite(x); }))
    findings.fail("number_out_of_range", "A number is not finite.", place);
}

constexpr const char* kExtensionPlace = "/extensions/KILN_radiance_transfer";

/// Fills the rows that the header names.
void read_components(const gltf::BufferBytes& bytes, BakedHeader& header, Findings& findings) {
  const auto read = [&](int view, const char* extension, StoredForm& form) {
    if (view < 0) return;
    read_floats(bytes, view, std::string(extension) + "/components/bufferView", form.components.rows, findings);
  };
  read(header.components_view, kExtensionPlace, header.form);
  read(header.field_view, "/extensions/KILN_light_field", header.field_form);
}

/// The same for the matrices; returns the table of lobes that belongs to them.
LobeTable read_glossy(const gltf::BufferBytes& bytes, BakedHeader& header, Findings& findings) {
  if (!header.glossy) return {};
  const std::string place = std::string(kExtensionPlace) + "/glossy/";
  read_floats(bytes, header.glossy_view, place + "components/bufferView", header.glossy.components.rows, findings);
  LobeTable lobes{header.glossy.order, std::vector<float>(LobeTable::size_of(header.glossy.order))};
  read_floats(bytes, header.lobes_view, place + "lobes/bufferView", lobes.numbers, findings);
  return lobes;
}

/// The blurred skies of a light field.
SkyLevels read_sky(const gltf::BufferBytes& bytes, BakedHeader& header, Findings& findings) {
  if (!header.sky) return {};
  PackedSky& levels = header.sky->levels;
  std::size_t count = 0;
  for (const int height : levels.heights)
    count += 2 * static_cast<std::size_t>(height) * static_cast<std::size_t>(height);
  const auto view = static_cast<std::size_t>(header.sky->levels_view);
  if (header.sky->levels_view < 0 || view >= bytes.views.size() || bytes.views[view].size() != count * 4) {
    findings.fail("slot_count_mismatch", "The buffer view does not hold just these texels.",
                  "/extensions/KILN_light_field/sky/levels/bufferView");
    return {};
  }
  levels.texels.resize(count);
  std::memcpy(levels.texels.data(), bytes.views[view].data(), count * 4);
  return unpack_sky(levels);
}

BakedScene read_file(std::span<const std::uint8_t> file, Findings& findings) {
  const GltfContainer container = open_glb(file, findings);
  if (findings.failed()) return {};
  scan_json(container.json, {}, findings);
  if (findings.failed()) return {};
  BakedHeader header = read_baked_header(container.json, findings);
  if (findings.failed()) return {};
  const gltf::Document document = gltf::load_document(container.json, findings);
  if (!findings.failed()) gltf::check_document(document, findings);
  if (!findings.failed()) check_shape(document, header, findings);
  if (findings.failed()) return {};
  const gltf::BufferBytes bytes = gltf::load_bytes(document, container, {}, {}, findings);
  if (findings.failed()) return {};
  read_components(bytes, header, findings);
  if (findings.failed()) return {};
  const LobeTable lobes = read_glossy(bytes, header, findings);
  if (findings.failed()) return {};
  const SkyLevels sky = read_sky(bytes, header, findings);
  if (findings.failed()) return {};
  return read_scene({document, bytes, header, lobes, sky}, findings);
}

/// Which images the bake looks at.
std::vector<bool> shaded_images(const Scene& scene) {
  std::vector<bool> out(scene.images.size(), false);
  for (const Material& m : scene.materials) {
    for (const int texture :
         {m.base_color_texture.texture, m.emission_texture.texture, m.metallic_roughness_texture.texture}) {
      const int image = texture < 0 ? -1 : scene.textures[static_cast<std::size_t>(texture)].image;
      if (image >= 0) out[static_cast<std::size_t>(image)] = true;
    }
  }
  return out;
}

void decode_pixels_of(Image& image) {
  const auto header = read_image_header(image.encoded);
  auto pixels = header ? decode_image(image.encoded, *header) : std::nullopt;
  if (!pixels) return;
  image.width = static_cast<int>(header->width);
  image.height = static_cast<int>(header->height);
  image.rgba = std::move(*pixels);
}

}  // namespace

void decode_pixels(Scene& scene) {
  const std::vector<bool> shaded = shaded_images(scene);
  for (std::size_t i = 0; i < shaded.size(); ++i) {
    if (shaded[i]) decode_pixels_of(scene.images[i]);
  }
}

Result<BakedScene> read_baked_glb(std::span<const std::uint8_t> file, const std::string& name) {
  Findings findings(name);
  BakedScene out = read_file(file, findings);
  if (findings.failed()) return tl::make_unexpected(findings.fault());
  return out;
}

}  // namespace kiln
