#include "core/artifact/baked_geometry.h"

#include <algorithm>
#include <cmath>

#include "core/artifact/look.h"

namespace kiln {
namespace {

constexpr int kColorBits = 10;
constexpr int kTangentBits = 12;  // (2^12 - 1) steps of 2 / (2^12 - 1) give exactly 2 in float, so that w stays +-1
constexpr std::uint32_t kUnused = 0xFFFFFFFF;

bool has_area(const Triangle& t) { return t[0] != t[1] && t[1] != t[2] && t[2] != t[0]; }

/// The triangles of one part with vertices renumbered from 0, and the vertices they use, ascending.
struct PartMesh {
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> vertices;
};

std::vector<PartMesh> split_by_part(const Scene& scene) {
  std::vector<PartMesh> out(scene.parts.size());
  for (std::size_t t = 0; t < scene.mesh.triangles.size(); ++t) {
    const Triangle& triangle = scene.mesh.triangles[t];
    if (has_area(triangle)) out[scene.mesh.part[t]].triangles.push_back(triangle);
  }
  std::vector<std::uint32_t> number(scene.mesh.position.size(), kUnused);
  for (PartMesh& part : out) {
    for (const Triangle& t : part.triangles) part.vertices.insert(part.vertices.end(), t.begin(), t.end());
    std::ranges::sort(part.vertices);
    part.vertices.erase(std::unique(part.vertices.begin(), part.vertices.end()), part.vertices.end());
    for (std::size_t i = 0; i < part.vertices.size(); ++i) number[part.vertices[i]] = static_cast<std::uint32_t>(i);
    for (Triangle& t : part.triangles) t = {number[t[0]], number[t[1]], number[t[2]]};
  }
  return out;
}

/// Flattens f(vertex), an array of N floats, over the part's vertices.
template <std::size_t N, class F>
std::vector<float> gather(std::span<const std::uint32_t> vertices, const F& f) {
  std::vector<float> out;
  out.reserve(vertices.size() * N);
  for (const auto v : vertices) {
    const std::array<float, N> values = f(v);
    out.insert(out.end(), values.begin(), values.end());
  }
  return out;
}

float unit(float x) { return std::clamp(x, 0.0F, 1.0F); }

/// Texture coordinates keep the step that `bits` give to the range [0, 1], however far they reach (up to 24 bits, and
/// 1e30: far beyond where floats are whole numbers).
VertexStream texcoord_stream(const std::vector<Vec2f>& uv, std::span<const std::uint32_t> vertices, int bits) {
  const auto near = [](float x) { return std::clamp(x, -1e30F, 1e30F); };
  VertexStream out{StreamKind::texcoord, 2, bits, {near(uv[vertices[0]].x), near(uv[vertices[0]].y)}, 1, {}};
  out.values = gather<2>(vertices, [&](auto v) { return std::array{near(uv[v].x), near(uv[v].y)}; });
  std::array<float, 2> high{out.origin[0], out.origin[1]};
  for (std::size_t i = 0; i < out.values.size(); ++i) {
    out.origin[i % 2] = std::min(out.origin[i % 2], out.values[i]);
    high[i % 2] = std::max(high[i % 2], out.values[i]);
  }
  out.range = std::max({high[0] - out.origin[0], high[1] - out.origin[1], 0x1p-10F});
  out.bits = std::clamp(bits + static_cast<int>(std::ceil(std::log2(out.range))), 4, 24);
  return out;
}

VertexStream color_stream(std::vector<float> values) {
  return {StreamKind::color, 4, kColorBits, {0, 0, 0, 0}, 1, std::move(values)};
}

bool uses_uv_set(const Material& m, int set) {
  const auto uses = [&](const TextureRef& ref) { return ref.texture >= 0 && ref.uv_set == set; };
  return uses(m.base_color_texture) || uses(m.metallic_roughness_texture) || uses(m.emission_texture) ||
         uses(m.normal_texture);
}

class PrimitiveBuilder {
 public:
  PrimitiveBuilder(const BakedScene& baked, std::uint32_t part, PartMesh mesh)
      : baked_(baked), mesh_(baked.scene.mesh), part_(baked.scene.parts[part]), vertices_(std::move(mesh.vertices)) {
    out_.part = part;
    out_.mesh.triangles = std::move(mesh.triangles);
  }

  void add_geometry(const Encoding& e) {
    const auto grid = [](float x) { return std::clamp(x, -0.5F, 0.5F); };
    add({"POSITION"},
        {StreamKind::position, 3, e.position_bits, {-0.5F, -0.5F, -0.5F, 0}, 1, gather<3>(vertices_, [&](auto v) {
           const Vec3f& p = mesh_.position[v];
           return std::array{grid(p.x), grid(p.y), grid(p.z)};
         })});
    add({"NORMAL"}, {StreamKind::normal, 3, e.normal_bits, {}, 1, gather<3>(vertices_, [&](auto v) {
                       const Vec3f& n = mesh_.normal[v];
                       return std::array{n.x, n.y, n.z};
                     })});
    add_texcoords(0, part_.has_uv0 ? &mesh_.uv0 : nullptr, e.texcoord_bits);
    add_texcoords(1, part_.has_uv1 ? &mesh_.uv1 : nullptr, e.lightmap_bits);
    if (part_.has_tangent) {
      add({"TANGENT"}, {StreamKind::generic, 4, kTangentBits, {-1, -1, -1, -1}, 2, gather<4>(vertices_, [&](auto v) {
                          const Vec4f& t = mesh_.tangent[v];
                          return std::array{t.x, t.y, t.z, t.w < 0 ? -1.0F : 1.0F};
                        })});
    }
  }

  void add_colors(std::span<const Vec3f> display) {
    add({"COLOR_0", true, false}, color_stream(gather<4>(vertices_, [&](auto v) {
          const float alpha = part_.has_color ? unit(mesh_.color[v].w) : 1;
          return std::array{unit(display[v].x), unit(display[v].y), unit(display[v].z), alpha};
        })));
    if (!part_.has_color) return;
    add({"COLOR_0", false, true}, original_color({1, 1, 1, 1}));
    const Material& material = baked_.scene.materials[static_cast<std::size_t>(part_.material)];
    add({"_ALBEDO", true, false}, original_color(material.base_color));
  }

  /// `name(k)` is that of VEC4 k.
  template <class Name>
  void add_coefficients(const StoredTransfer& transfer, const Name& name) {
    for (std::size_t k = 0; k < vec4s_of(transfer.form().count()); ++k) {
      add({name(k), true, false},
          {StreamKind::generic, 4, transfer.bits(k), {-1, -1, -1, -1}, 2, transfer.pack(k, vertices_)});
    }
  }

  /// Of a part whose vertices have matrices.
  void add_matrices(const StoredGlossy& glossy) {
    for (std::size_t k = 0; glossy.has(vertices_[0]) && k < glossy.vec4s(); ++k) {
      add({glossy_name(k), true, false},
          {StreamKind::generic, 4, glossy.bits(k), {-1, -1, -1, -1}, 2, glossy.pack(k, vertices_)});
    }
  }

  PartPrimitive take() { return std::move(out_); }

 private:
  void add(NamedStream name, VertexStream stream) {
    name.components = stream.components;
    out_.names.push_back(std::move(name));
    out_.mesh.streams.push_back(std::move(stream));
  }

  /// A part without coordinates that its textures ask for gets zeros: so the bake saw it, and the format demands it, as
  /// it demands the first set where there is the second.
  void add_texcoords(int set, const std::vector<Vec2f>* uv, int bits) {
    const Material& material = baked_.scene.materials[static_cast<std::size_t>(part_.material)];
    if (uv) {
      add({"TEXCOORD_" + std::to_string(set)}, texcoord_stream(*uv, vertices_, bits));
    } else if (uses_uv_set(material, set) || (set == 0 && (part_.has_uv1 || uses_uv_set(material, 1)))) {
      add({"TEXCOORD_" + std::to_string(set)},
          {StreamKind::texcoord, 2, bits, {}, 1, std::vector<float>(2 * vertices_.size(), 0.0F)});
    }
  }

  VertexStream original_color(const Vec4f& factor) const {
    return color_stream(gather<4>(vertices_, [&](auto v) {
      const Vec4f& c = mesh_.color[v];
      return std::array{unit(c.x * factor.x), unit(c.y * factor.y), unit(c.z * factor.z), unit(c.w * factor.w)};
    }));
  }

  const BakedScene& baked_;
  const Mesh& mesh_;
  const Part& part_;
  std::vector<std::uint32_t> vertices_;
  PartPrimitive out_;
};

}  // namespace

std::vector<std::uint32_t> used_vertices(const Mesh& mesh) {
  std::vector<bool> used(mesh.position.size(), false);
  for (const Triangle& t : mesh.triangles) {
    if (has_area(t)) used[t[0]] = used[t[1]] = used[t[2]] = true;
  }
  std::vector<std::uint32_t> out;
  for (std::size_t v = 0; v < used.size(); ++v) {
    if (used[v]) out.push_back(static_cast<std::uint32_t>(v));
  }
  return out;
}

Result<void> visit_part_primitives(const BakedScene& baked, const GeometryOptions& options, const PartVisitor& visit) {
  const std::vector<Vec3f> colors = displayed_colors(baked);
  auto meshes = split_by_part(baked.scene);
  for (std::size_t part = 0; part < meshes.size(); ++part) {
    if (meshes[part].triangles.empty()) continue;
    PrimitiveBuilder builder(baked, static_cast<std::uint32_t>(part), std::move(meshes[part]));
    builder.add_geometry(options.encoding);
    builder.add_colors(colors);
    if (options.transfer)
      builder.add_coefficients(*options.transfer, [&](std::size_t k) { return options.transfer->name(k); });
    if (options.field) builder.add_coefficients(options.field->numbers(), field_name);
    if (options.field && options.field->visibility()) builder.add_coefficients(*options.field->visibility(), sky_name);
    if (options.field && options.field->lamps()) builder.add_coefficients(*options.field->lamps(), lamp_name);
    if (options.glossy) builder.add_matrices(*options.glossy);
    if (auto done = visit(builder.take()); !done) return done;
  }
  return {};
}

}  // namespace kiln
