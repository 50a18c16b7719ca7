// glTF as a stream: accessors are read element by element where they lie.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "core/artifact/assemble.h"
#include "core/artifact/gltf_check.h"
#include "core/artifact/gltf_images.h"
#include "core/artifact/gltf_load.h"
#include "core/artifact/gltf_placement.h"
#include "core/artifact/gltf_primitive.h"
#include "core/artifact/gltf_radiance.h"
#include "core/artifact/json_scan.h"
#include "core/artifact/triangle_stream.h"
#include "core/scene/texture.h"

namespace kiln {
namespace {

using namespace gltf;

/// Everything a pass needs. The document's bytes lie in `files`.
struct GltfFile {
  SceneFiles files;
  Document document;
  BufferBytes bytes;
  std::vector<Placement> placements;
  Scene look;  // materials, textures and images; no mesh
  AccessorSource source() const { return {document, bytes}; }
  const std::uint8_t* begin() const { return Span(files.main).data(); }
};

std::string primitive_place(std::size_t mesh, std::size_t primitive) {
  return "/meshes/" + std::to_string(mesh) + "/primitives/" + std::to_string(primitive);
}

std::uint64_t corner_count(Mode mode, std::uint64_t indices) {
  return mode == Mode::triangles ? indices / 3 : indices < 3 ? 0 : indices - 2;
}

/// Number of the index at corner c of triangle t.
std::uint64_t corner_of(Mode mode, std::uint64_t t, std::uint64_t c) {
  if (mode == Mode::triangles) return 3 * t + c;
  if (mode == Mode::triangle_fan) return c == 2 ? 0 : t + 1 + c;
  const std::uint64_t odd = t % 2;
  return c == 0 ? t : t + (c == 1 ? 1 + odd : 2 - odd);
}

/// One primitive, in whatever form its numbers have: accessors where they lie, or a decoded part.
class PrimitiveReader {
 public:
  PrimitiveReader(const GltfFile& file, const Primitive& primitive, std::string place, Findings& findings)
      : primitive_(primitive), place_(std::move(place)), begin_(file.begin()), size_(file.files.main.size()) {
    const AccessorSource source = file.source();
    if (primitive.draco.view >= 0) {
      part_ = read_primitive(source, primitive, place_, findings);
      vertices_ = part_.position.size();
      triangles_ = part_.triangles.size();
      return;
    }
    const auto open = [&](const char* name, std::uint64_t least, std::uint64_t most) -> std::optional<AccessorReader> {
      const int index = primitive.attribute(name);
      if (index < 0) return std::nullopt;
      AccessorReader reader(source, index, place_ + "/attributes/" + name, findings);
      if (reader.width() < least || reader.width() > most) {
        findings.fail("accessor_type", "The number of components does not fit the attribute.",
                      place_ + "/attributes/" + name);
      }
      return reader;
    };
    position_ = open("POSITION", 3, 3);
    normal_ = open("NORMAL", 3, 3);
    color_ = open("COLOR_0", 3, 4);
    uv_[0] = open("TEXCOORD_0", 2, 2);
    uv_[1] = open("TEXCOORD_1", 2, 2);
    if (primitive.indices >= 0) indices_.emplace(source, primitive.indices, place_ + "/indices", findings);
    vertices_ = position_->count();
    triangles_ = corner_count(primitive.mode, indices_ ? indices_->count() : vertices_);
  }

  std::uint64_t triangles() const { return triangles_; }

  /// Vertex numbers of triangles [begin, end).
  Result<void> corners(std::uint64_t begin, std::uint64_t end, std::vector<std::uint32_t>& out) const {
    for (std::uint64_t t = begin; t < end; ++t) {
      for (std::uint64_t c = 0; c < 3; ++c) {
        const std::uint64_t at = corner_of(primitive_.mode, t, c);
        const std::uint32_t v = !part_.triangles.empty() ? part_.triangles[t][c]
                                : indices_               ? indices_->index(at)
                                                         : static_cast<std::uint32_t>(at);
        if (v >= vertices_) {
          return fault(
              "index_out_of_range", std::to_string(v) + " >= " + std::to_string(vertices_) + ".",
              place_ + "/indices element " + std::to_string(at) + (indices_ ? byte_text(indices_->address(at)) : ""));
        }
        out.push_back(v);
      }
    }
    return {};
  }

  Vec3d position(std::uint32_t v) const {
    if (!position_) return to_double(part_.position[v]);
    float p[3];
    position_->floats(v, p);
    return {p[0], p[1], p[2]};
  }
  Vec3f normal(std::uint32_t v) const {
    if (!normal_) return part_.normal.empty() ? Vec3f{} : part_.normal[v];
    float n[3];
    normal_->floats(v, n);
    return {n[0], n[1], n[2]};
  }
  const Material& material(const Scene& look) const {
    return look.materials[static_cast<std::size_t>(primitive_.material)];
  }
  /// Of the set that the base colour's texture uses.
  Vec2f uv(std::uint32_t v, const Scene& look) const { return uv_at(v, material(look).base_color_texture.uv_set); }
  Vec3f own_color(std::uint32_t v) const {
    if (!color_)
      return part_.color.empty() ? Vec3f{1, 1, 1} : Vec3f{part_.color[v].x, part_.color[v].y, part_.color[v].z};
    float c[4];
    color_->floats(v, c);
    return {c[0], c[1], c[2]};
  }
  Fault bad_number(std::uint32_t v, bool finite) const {
    return {finite ? "position_out_of_range" : "non_finite_geometry",
            finite ? "A coordinate is larger than 1e18." : "A value is not finite.",
            place_ + "/attributes/POSITION element " + std::to_string(v) +
                (position_ ? byte_text(position_->address(v)) : "")};
  }

 private:
  std::string byte_text(const std::uint8_t* at) const {
    const bool inside = at && !std::less<>()(at, begin_) && std::less<>()(at, begin_ + size_);
    return inside ? " at byte " + std::to_string(at - begin_) : "";
  }
  Vec2f uv_at(std::uint32_t v, int set) const {
    const auto& reader = uv_[set == 1 ? 1 : 0];
    const auto& held = set == 1 ? part_.uv1 : part_.uv0;
    if (!reader) return held.empty() ? Vec2f{} : held[v];
    float uv[2];
    reader->floats(v, uv);
    return std::isfinite(uv[0]) && std::isfinite(uv[1]) ? Vec2f{uv[0], uv[1]} : Vec2f{};
  }

  const Primitive& primitive_;
  std::string place_;
  const std::uint8_t* begin_;
  std::size_t size_;
  std::uint64_t vertices_ = 0, triangles_ = 0;
  std::optional<AccessorReader> position_, normal_, color_, uv_[2], indices_;
  RawPart part_;
};

/// Linear base colour: factor x texture x vertex colour.
Vec3f base_color(const Scene& look, const Material& m, const Vec2f& uv, const Vec3f& own) {
  const Vec4f texel = sample_texture(look, m.base_color_texture, uv, true);
  const auto unit = [](float x) { return std::clamp(x, 0.0F, 1.0F); };
  return {unit(m.base_color.x * texel.x * own.x), unit(m.base_color.y * texel.y * own.y),
          unit(m.base_color.z * texel.z * own.z)};
}

/// One pass over everything that is placed.
class Pass {
 public:
  Pass(const GltfFile& file, bool normals, bool colors, const TriangleSource::Take& take, Threads& threads)
      : file_(file), normals_(normals), colors_(colors), take_(take), threads_(threads) {
    if (colors_ && textured(file))
      batch_.texture = [this](std::size_t t, double u, double v) { return color(t, u, v); };
  }

  static bool textured(const GltfFile& file) {
    return std::any_of(file.look.materials.begin(), file.look.materials.end(),
                       [](const Material& m) { return m.base_color_texture.texture >= 0; });
  }

  Result<void> run() {
    for (const Placement& placement : file_.placements) {
      const auto mesh = static_cast<std::size_t>(placement.mesh);
      for (std::size_t p = 0; p < file_.document.meshes[mesh].primitives.size(); ++p) {
        const Primitive& primitive = file_.document.meshes[mesh].primitives[p];
        if (!has_surface(primitive)) continue;
        Findings findings{std::string()};
        const PrimitiveReader reader(file_, primitive, primitive_place(mesh, p), findings);
        if (findings.failed()) return tl::make_unexpected(findings.fault());
        for (const Affine& world : placement.instances) {
          if (auto done = stream(reader, world); !done) return done;
        }
      }
    }
    return flush();
  }

 private:
  Result<void> stream(const PrimitiveReader& reader, const Affine& world) {
    for (std::uint64_t t = 0; t < reader.triangles();) {
      threads_.check();
      const std::uint64_t room = kBatchTriangles - batch_.triangles();
      const std::uint64_t end = std::min(reader.triangles(), t + room);
      corners_.corners.clear();
      if (auto read = reader.corners(t, end, corners_.corners); !read) return read;
      if (auto got = fetch(reader, world); !got) return got;
      t = end;
      if (batch_.triangles() < kBatchTriangles) continue;
      if (auto flushed = flush(); !flushed) return flushed;
    }
    return {};
  }

  /// Adds the corners' values to the batch; a mirror turns triangles round.
  Result<void> fetch(const PrimitiveReader& reader, const Affine& world) {
    const std::size_t before = batch_.position.size(), after = before + corners_.corners.size();
    const bool mirrored = world.determinant() < 0;
    const Affine turn = cofactors(world);
    batch_.position.resize(after);
    if (normals_) batch_.normal.resize(after);
    if (colors_) batch_.color.resize(after), uv_.resize(after), own_.resize(after);
    if (colors_) material_.resize(after / 3, &reader.material(file_.look));
    const auto bad = fetch_corners(corners_, threads_, [&](std::uint32_t v, std::size_t i) {
      const std::size_t c = i % 3, at = before + i - c + (mirrored && c > 0 ? 3 - c : c);
      const Vec3d local = reader.position(v);
      batch_.position[at] = world.point(local);
      if (normals_) {
        const Vec3d n = turn.vector(to_double(reader.normal(v)));
        batch_.normal[at] = normalized(to_float(normalized(mirrored ? -n : n, Vec3d{})), Vec3f{});
      }
      if (colors_) {
        uv_[at] = reader.uv(v, file_.look), own_[at] = reader.own_color(v);
        batch_.color[at] = base_color(file_.look, reader.material(file_.look), uv_[at], own_[at]);
      }
      return is_sane_position(batch_.position[at]) && (!colors_ || is_finite(batch_.color[at]));
    });
    if (!bad) return {};
    const std::uint32_t v = corners_.corners[*bad];
    return tl::make_unexpected(reader.bad_number(v, is_finite(reader.position(v))));
  }

  Result<void> flush() {
    if (batch_.position.empty()) return {};
    take_(batch_);
    batch_.first += batch_.triangles();
    batch_.position.clear(), batch_.normal.clear(), batch_.color.clear();
    uv_.clear(), own_.clear(), material_.clear();
    return {};
  }

  Vec3f color(std::size_t t, double u, double v) const {
    const auto a = static_cast<float>(1 - u - v), b = static_cast<float>(u), c = static_cast<float>(v);
    const Vec2f* at = &uv_[3 * t];
    const Vec2f uv{a * at[0].x + b * at[1].x + c * at[2].x, a * at[0].y + b * at[1].y + c * at[2].y};
    return base_color(file_.look, *material_[t], uv, own_[3 * t] * a + own_[3 * t + 1] * b + own_[3 * t + 2] * c);
  }

  const GltfFile& file_;
  bool normals_, colors_;
  const TriangleSource::Take& take_;
  Threads& threads_;
  TriangleBatch batch_;
  CornerBatch corners_;
  std::vector<Vec2f> uv_;                  // of each corner of the batch
  std::vector<Vec3f> own_;                 // vertex colour
  std::vector<const Material*> material_;  // of each triangle
};

/// Only base colours are carried along: their images are decoded, others are named.
void keep_base_colors(Document& d, Findings& findings) {
  for (std::size_t i = 0; i < d.materials.size(); ++i) {
    Material& m = d.materials[i];
    const std::string place = "/materials/" + std::to_string(i);
    if (m.normal_texture.texture >= 0)
      findings.warn("normal_texture_dropped", "A reduction keeps the normals of triangles, not of textures.", place);
    if (m.emission_texture.texture >= 0 || length(m.emission) > 0)
      findings.warn("emission_dropped", "A reduction keeps base colours; emission is left out.", place);
    if (m.metallic_roughness_texture.texture >= 0)
      findings.warn("roughness_dropped", "A reduction keeps base colours; metalness and roughness are left out.",
                    place);
    if (m.alpha_mode != AlphaMode::opaque)
      findings.warn("alpha_dropped", "A reduction is opaque; transparency is left out.", place);
    m.emission_texture.texture = m.metallic_roughness_texture.texture = m.normal_texture.texture = -1;
  }
}

bool has_color(const GltfFile& file) {
  for (const Placement& placement : file.placements) {
    for (const Primitive& p : file.document.meshes[static_cast<std::size_t>(placement.mesh)].primitives) {
      const Material& m = file.look.materials[static_cast<std::size_t>(p.material)];
      if (p.attribute("COLOR_0") >= 0 || m.base_color_texture.texture >= 0 || m.base_color != Vec4f{1, 1, 1, 1})
        return true;
    }
  }
  return false;
}

void count(const GltfFile& file, TriangleSource& source) {
  for (const Placement& placement : file.placements) {
    for (const Primitive& p : file.document.meshes[static_cast<std::size_t>(placement.mesh)].primitives) {
      if (!has_surface(p)) continue;
      const std::uint64_t n = placement.instances.size();
      const auto& accessors = file.document.accessors;
      const std::uint64_t vertices = accessors[static_cast<std::size_t>(p.attribute("POSITION"))].count;
      source.vertices += n * vertices;
      source.triangles +=
          n * corner_count(p.mode, p.indices < 0 ? vertices : accessors[static_cast<std::size_t>(p.indices)].count);
      source.normals |= p.attribute("NORMAL") >= 0;
    }
  }
}

bool load(GltfFile& file, const ImportLimits& limits, Findings& findings) {
  ImportLimits placed = limits;  // what is placed is streamed, not held
  placed.max_triangles = placed.max_memory_bytes = std::numeric_limits<std::uint64_t>::max();
  const Span main = file.files.main;
  const GltfContainer container = looks_like_glb(main) ? open_glb(main, findings) : open_gltf(main, findings);
  if (!findings.failed()) scan_json(container.json, {}, findings);
  if (!findings.failed()) file.document = load_document(container.json, findings);
  if (!findings.failed()) file.bytes = load_bytes(file.document, container, file.files, limits, findings);
  if (!findings.failed()) check_document(file.document, findings);
  if (!findings.failed()) file.placements = place_nodes(file.source(), placed, findings).meshes;
  if (findings.failed()) return false;
  if (file.document.radiance) warn_of_unused_radiance(findings);
  keep_base_colors(file.document, findings);
  file.look.materials = file.document.materials;
  file.look.textures = file.document.textures;
  file.look.images = load_images(file.document, file.bytes, file.files, limits, findings);
  for (Image& image : file.look.images) image.encoded = {};
  file.look.materials.push_back({.name = "default"});  // of primitives that name none
  for (gltf::Mesh& mesh : file.document.meshes) {
    for (Primitive& p : mesh.primitives) {
      if (p.material < 0) p.material = static_cast<int>(file.look.materials.size()) - 1;
    }
  }
  return !findings.failed();
}

}  // namespace

TriangleSource open_gltf_triangles(const SceneFiles& files, const StreamOptions& options, Findings& findings) {
  TriangleSource source;
  ImportLimits limits;
  limits.max_memory_bytes = options.max_memory_bytes;
  limits.max_total_pixels = std::min(limits.max_total_pixels, options.max_memory_bytes / 4 / 4);
  const auto file = std::make_shared<GltfFile>();
  file->files = files;
  if (!load(*file, limits, findings)) return source;
  count(*file, source);
  for (const Bytes& held : file->bytes.owned) source.memory_bytes += held.size();
  for (const Image& image : file->look.images) {
    source.memory_bytes += image.rgba.size();
    source.texels = std::max<std::uint64_t>(source.texels, image.rgba.size() / 4);
  }
  if (source.memory_bytes > options.max_memory_bytes / 2) {
    findings.fail("memory_limit", "Decoded buffers and images would take more than half of limits.memory_mb.");
  }
  if (source.triangles == 0)
    findings.fail("empty_scene", "No node of the default scene has a mesh with triangles: there is no surface.");
  if (findings.failed()) return TriangleSource{};
  source.colors = has_color(*file);
  const bool normals = source.normals, colors = source.colors;
  source.stream = [file, normals, colors](Detail detail, const TriangleSource::Take& take, Threads& threads) {
    const bool all = detail == Detail::all;
    auto done = Pass(*file, all && normals, all && colors, take, threads).run();
    if (!done) done.error().where = file->files.name + ": " + done.error().where;
    return done;
  };
  return source;
}

}  // namespace kiln
