#include <cmath>
#include <limits>

#include "core/artifact/gltf_parse_parts.h"

namespace kiln::gltf {
namespace {

void fail(const Fields& f, const char* key, const char* code, const std::string& message) {
  f.findings().fail(code, message, f.pointer(key));
}

void require(const Fields& f, const char* key) {
  if (!f.has(key))
    f.findings().fail("property_missing", std::string("The property \"") + key + "\" is required.", f.pointer());
}

Meshopt parse_meshopt(const Fields& f, const Sizes& sizes) {
  Meshopt m;
  for (const char* key : {"buffer", "byteLength", "byteStride", "count", "mode"}) require(f, key);
  m.buffer = f.index("buffer", sizes.buffers);
  m.offset = f.count("byteOffset", 0);
  m.bytes = f.count("byteLength", 0);
  m.stride = f.count("byteStride", 0);
  m.count = f.count("count", 0);
  const std::string mode = f.text("mode"), filter = f.text("filter");
  m.mode = mode == "ATTRIBUTES"  ? MeshoptMode::attributes
           : mode == "TRIANGLES" ? MeshoptMode::triangles
           : mode == "INDICES"   ? MeshoptMode::indices
                                 : MeshoptMode::none;
  m.filter = filter == "OCTAHEDRAL"    ? MeshoptFilter::octahedral
             : filter == "QUATERNION"  ? MeshoptFilter::quaternion
             : filter == "EXPONENTIAL" ? MeshoptFilter::exponential
                                       : MeshoptFilter::none;
  if (m.mode == MeshoptMode::none) fail(f, "mode", "unknown_enum", "The mode of compression is not known.");
  if (m.filter == MeshoptFilter::none && !filter.empty() && filter != "NONE") {
    fail(f, "filter", "unknown_enum", "The filter is not known.");
  }
  return m;
}

Component parse_component(const Fields& f, const char* key) {
  require(f, key);
  const std::uint64_t code = f.count(key, 5126);
  if (code < 5120 || code > 5126 || code == 5124) fail(f, key, "unknown_enum", "The component type is not known.");
  return static_cast<Component>(code);
}

void parse_type(const Fields& f, Accessor& a) {
  require(f, "type");
  const std::string type = f.text("type");
  a.matrix = type.substr(0, 3) == "MAT";
  a.width = type == "SCALAR"                   ? 1
            : type == "VEC2"                   ? 2
            : type == "VEC3"                   ? 3
            : type == "VEC4" || type == "MAT2" ? 4
            : type == "MAT3"                   ? 9
            : type == "MAT4"                   ? 16
                                               : 0;
  if (a.width == 0) fail(f, "type", "unknown_enum", "The accessor type is not known.");
}

Sparse parse_sparse(const Fields& f, const Sizes& sizes) {
  const Fields indices = f.object("indices"), values = f.object("values");
  for (const char* key : {"count", "indices", "values"}) require(f, key);
  require(indices, "bufferView");
  require(values, "bufferView");
  Sparse s;
  s.count = f.count("count", 0);
  if (s.count == 0) fail(f, "count", "accessor_sparse_count", "A sparse accessor must replace at least one element.");
  s.index_view = indices.index("bufferView", sizes.views);
  s.index_offset = indices.count("byteOffset", 0);
  s.index_component = parse_component(indices, "componentType");
  s.value_view = values.index("bufferView", sizes.views);
  s.value_offset = values.count("byteOffset", 0);
  const bool is_index =
      s.index_component == Component::u8 || s.index_component == Component::u16 || s.index_component == Component::u32;
  if (!is_index) fail(indices, "componentType", "accessor_type", "Sparse indices must be unsigned integers.");
  return s;
}

std::vector<double> parse_bounds(const Fields& f, const char* key) {
  std::vector<double> out;
  if (f.size(key) == 3) {
    for (const double x : f.numbers<3>(key, {})) out.push_back(x);
  }
  return out;
}

DracoData parse_draco(const Fields& f, const Sizes& sizes) {
  require(f, "bufferView");
  return {.view = f.index("bufferView", sizes.views),
          .attributes = f.index_map("attributes", std::numeric_limits<std::int32_t>::max())};
}

Primitive parse_primitive(const Fields& f, const Sizes& sizes) {
  Primitive p;
  require(f, "attributes");
  p.attributes = f.index_map("attributes", sizes.accessors);
  p.indices = f.index("indices", sizes.accessors);
  p.material = f.index("material", sizes.materials);
  const std::uint64_t mode = f.count("mode", 4);
  if (mode > 6) fail(f, "mode", "unknown_enum", "The primitive mode is not known.");
  p.mode = static_cast<Mode>(std::min<std::uint64_t>(mode, 6));
  p.morphed = f.size("targets") > 0;
  f.for_each("targets", [&](const Fields& target) {
    if (target.has("POSITION")) target.index("POSITION", sizes.accessors);
  });
  if (f.has_extension("KHR_draco_mesh_compression"))
    p.draco = parse_draco(f.extension("KHR_draco_mesh_compression"), sizes);
  return p;
}

/// Column-major translation * rotation * scale.
std::array<double, 16> parse_transform(const Fields& f) {
  const auto t = f.numbers<3>("translation", {0, 0, 0});
  const auto s = f.numbers<3>("scale", {1, 1, 1});
  auto q = f.numbers<4>("rotation", {0, 0, 0, 1});
  const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(norm > 0) || !std::isfinite(norm)) {
    f.findings().warn("node_rotation_invalid", "A rotation without a direction is taken as none.",
                      f.pointer("rotation"));
    q = {0, 0, 0, 1};
  } else {
    for (double& x : q) x /= norm;
  }
  const double x = q[0], y = q[1], z = q[2], w = q[3];
  return {s[0] * (1 - 2 * (y * y + z * z)),
          s[0] * 2 * (x * y + z * w),
          s[0] * 2 * (x * z - y * w),
          0,
          s[1] * 2 * (x * y - z * w),
          s[1] * (1 - 2 * (x * x + z * z)),
          s[1] * 2 * (y * z + x * w),
          0,
          s[2] * 2 * (x * z + y * w),
          s[2] * 2 * (y * z - x * w),
          s[2] * (1 - 2 * (x * x + y * y)),
          0,
          t[0],
          t[1],
          t[2],
          1};
}

}  // namespace

std::uint64_t component_bytes(Component c) {
  return c == Component::i8 || c == Component::u8 ? 1 : c == Component::i16 || c == Component::u16 ? 2 : 4;
}

Buffer parse_buffer(const Fields& f) {
  require(f, "byteLength");
  Buffer b{.bytes = f.count("byteLength", 0), .uri = f.text("uri"), .has_uri = f.has("uri")};
  if (f.has_extension("EXT_meshopt_compression"))
    b.fallback = f.extension("EXT_meshopt_compression").flag("fallback", false);
  return b;
}

BufferView parse_view(const Fields& f, const Sizes& sizes) {
  require(f, "buffer");
  require(f, "byteLength");
  BufferView v{.buffer = f.index("buffer", sizes.buffers),
               .offset = f.count("byteOffset", 0),
               .bytes = f.count("byteLength", 0),
               .stride = f.count("byteStride", 0)};
  if (v.stride > 252) fail(f, "byteStride", "view_stride", "A stride of " + std::to_string(v.stride) + " is over 252.");
  if (f.has_extension("EXT_meshopt_compression"))
    v.meshopt = parse_meshopt(f.extension("EXT_meshopt_compression"), sizes);
  return v;
}

Accessor parse_accessor(const Fields& f, const Sizes& sizes) {
  Accessor a;
  require(f, "count");
  a.view = f.index("bufferView", sizes.views);
  a.offset = f.count("byteOffset", 0);
  a.count = f.count("count", 0);
  a.component = parse_component(f, "componentType");
  a.normalized = f.flag("normalized", false);
  parse_type(f, a);
  if (a.count == 0 || a.count > std::numeric_limits<std::uint32_t>::max()) {
    fail(f, "count", "accessor_count", "An accessor must have 1 to 4294967295 elements.");
  }
  if (f.has("sparse")) a.sparse = parse_sparse(f.object("sparse"), sizes);
  if (a.sparse.count > a.count) {
    fail(f, "sparse", "accessor_sparse_count",
         "More elements are replaced, " + std::to_string(a.sparse.count) + ", than the accessor has, " +
             std::to_string(a.count) + ".");
  }
  a.min = parse_bounds(f, "min");
  a.max = parse_bounds(f, "max");
  return a;
}

Mesh parse_mesh(const Fields& f, const Sizes& sizes) {
  require(f, "primitives");
  Mesh mesh{.name = f.text("name"), .primitives = {}};
  f.for_each("primitives", [&](const Fields& p) { mesh.primitives.push_back(parse_primitive(p, sizes)); });
  return mesh;
}

Node parse_node(const Fields& f, const Sizes& sizes) {
  Node n;
  n.name = f.text("name");
  n.children = f.indices("children", sizes.nodes);
  n.mesh = f.index("mesh", sizes.meshes);
  n.skinned = f.index("skin", sizes.skins) >= 0;
  n.matrix = f.has("matrix") ? f.numbers<16>("matrix", n.matrix) : parse_transform(f);
  if (f.has_extension("KHR_lights_punctual")) n.light = f.extension("KHR_lights_punctual").index("light", sizes.lights);
  if (f.has_extension("EXT_mesh_gpu_instancing")) {
    n.instanced = true;
    n.instancing = f.extension("EXT_mesh_gpu_instancing").index_map("attributes", sizes.accessors);
  }
  return n;
}

}  // namespace kiln::gltf
