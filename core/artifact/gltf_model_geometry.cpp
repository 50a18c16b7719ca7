#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/artifact/gltf_model.h"
#include "core/artifact/gltf_tree.h"

namespace kiln::gltf {
namespace {

using tinygltf::Value;

std::string place_of(const char* array, std::size_t i) { return std::string("/") + array + "/" + std::to_string(i); }

std::uint64_t whole_of(const Value& object, const char* name) {
  return static_cast<std::uint64_t>(number_of(object, name, 0));
}

/// A member that tinygltf was not shown under its name, or `seen`.
double set_aside_or(const Extensions& extensions, const char* name, double seen) {
  const Value* aside = find_extension(extensions, kSetAside);
  return aside ? number_of(*aside, name, seen) : seen;
}

Meshopt convert_meshopt(const Value& extension) {
  const std::string mode = text_of(extension, "mode"), filter = text_of(extension, "filter");
  return {.mode = mode == "ATTRIBUTES"  ? MeshoptMode::attributes
                  : mode == "TRIANGLES" ? MeshoptMode::triangles
                                        : MeshoptMode::indices,
          .filter = filter == "OCTAHEDRAL"    ? MeshoptFilter::octahedral
                    : filter == "QUATERNION"  ? MeshoptFilter::quaternion
                    : filter == "EXPONENTIAL" ? MeshoptFilter::exponential
                                              : MeshoptFilter::none,
          .buffer = index_of(extension, "buffer"),
          .offset = whole_of(extension, "byteOffset"),
          .bytes = whole_of(extension, "byteLength"),
          .stride = whole_of(extension, "byteStride"),
          .count = whole_of(extension, "count")};
}

BufferView convert_view(const tinygltf::BufferView& view, const std::string& place, Findings& findings) {
  BufferView out{.buffer = view.buffer, .offset = view.byteOffset, .bytes = view.byteLength};
  out.stride =
      static_cast<std::uint64_t>(set_aside_or(view.extensions, "byteStride", static_cast<double>(view.byteStride)));
  if (out.stride > 252) {
    findings.fail("view_stride", "A stride of " + std::to_string(out.stride) + " is over 252.", place + "/byteStride");
  }
  const Value* meshopt = find_extension(view.extensions, "EXT_meshopt_compression");
  if (meshopt) out.meshopt = convert_meshopt(*meshopt);
  return out;
}

Sparse convert_sparse(const tinygltf::Accessor& accessor) {
  const auto& s = accessor.sparse;
  if (!s.isSparse) return {};
  return {.count = static_cast<std::uint64_t>(s.count),
          .index_view = s.indices.bufferView,
          .value_view = s.values.bufferView,
          .index_component = static_cast<Component>(s.indices.componentType),
          .index_offset = static_cast<std::uint64_t>(s.indices.byteOffset),
          .value_offset = static_cast<std::uint64_t>(s.values.byteOffset)};
}

void check_sparse(const Accessor& a, const std::string& place, Findings& findings) {
  const Component c = a.sparse.index_component;
  if (a.sparse.count == 0) {
    findings.fail("accessor_sparse_count", "A sparse accessor must replace at least one element.", place + "/count");
  }
  if (c != Component::u8 && c != Component::u16 && c != Component::u32) {
    findings.fail("accessor_type", "Sparse indices must be unsigned integers.", place + "/indices/componentType");
  }
  if (a.sparse.count > a.count) {
    findings.fail("accessor_sparse_count",
                  "More elements are replaced, " + std::to_string(a.sparse.count) + ", than the accessor has, " +
                      std::to_string(a.count) + ".",
                  place);
  }
}

Accessor convert_accessor(const tinygltf::Accessor& accessor, const std::string& place, Findings& findings) {
  const auto type = static_cast<std::uint32_t>(accessor.type);
  Accessor out{.view = accessor.bufferView,
               .offset = accessor.byteOffset,
               .count = accessor.count,
               .component = static_cast<Component>(accessor.componentType),
               .normalized = accessor.normalized,
               .width = static_cast<std::uint64_t>(tinygltf::GetNumComponentsInType(type)),
               .matrix = type == TINYGLTF_TYPE_MAT2 || type == TINYGLTF_TYPE_MAT3 || type == TINYGLTF_TYPE_MAT4,
               .sparse = convert_sparse(accessor),
               .min = accessor.minValues,
               .max = accessor.maxValues};
  if (out.count == 0 || out.count > std::numeric_limits<std::uint32_t>::max()) {
    findings.fail("accessor_count", "An accessor must have 1 to 4294967295 elements.", place + "/count");
  }
  if (accessor.sparse.isSparse) check_sparse(out, place + "/sparse", findings);
  return out;
}

Primitive convert_primitive(const tinygltf::Primitive& primitive) {
  Primitive out{.attributes = primitive.attributes,
                .indices = static_cast<int>(set_aside_or(primitive.extensions, "indices", primitive.indices)),
                .material = primitive.material,
                .mode = static_cast<Mode>(primitive.mode),
                .morphed = !primitive.targets.empty()};
  const Value* draco = find_extension(primitive.extensions, "KHR_draco_mesh_compression");
  if (draco) {
    out.draco = {.view = index_of(*draco, "bufferView"), .attributes = index_map_of(*draco, "attributes")};
  }
  return out;
}

Mesh convert_mesh(const tinygltf::Mesh& mesh) {
  Mesh out{.name = mesh.name};
  for (const auto& primitive : mesh.primitives) out.primitives.push_back(convert_primitive(primitive));
  return out;
}

template <std::size_t N>
std::array<double, N> numbers(const std::vector<double>& values, std::array<double, N> absent) {
  if (values.size() == N) std::copy(values.begin(), values.end(), absent.begin());
  return absent;
}

/// Column-major translation * rotation * scale.
std::array<double, 16> transform_of(const tinygltf::Node& node, const std::string& place, Findings& findings) {
  const auto t = numbers<3>(node.translation, {0, 0, 0});
  const auto s = numbers<3>(node.scale, {1, 1, 1});
  auto q = numbers<4>(node.rotation, {0, 0, 0, 1});
  const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(norm > 0) || !std::isfinite(norm)) {
    findings.warn("node_rotation_invalid", "A rotation without a direction is taken as none.", place + "/rotation");
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

Node convert_node(const tinygltf::Node& node, const std::string& place, Findings& findings) {
  Node out{.name = node.name, .children = node.children, .mesh = node.mesh, .skinned = node.skin >= 0};
  out.matrix = node.matrix.empty() ? transform_of(node, place, findings) : numbers<16>(node.matrix, out.matrix);
  const Value* light = find_extension(node.extensions, "KHR_lights_punctual");
  if (light) out.light = index_of(*light, "light");
  const Value* instancing = find_extension(node.extensions, "EXT_mesh_gpu_instancing");
  if (instancing) {
    out.instanced = true;
    out.instancing = index_map_of(*instancing, "attributes");
  }
  return out;
}

/// Nodes of the default scene; of scene 0 if none is named; without scenes all nodes that are nobody's children.
std::vector<int> roots_of(const tinygltf::Model& model) {
  if (!model.scenes.empty()) return model.scenes.at(static_cast<std::size_t>(std::max(0, model.defaultScene))).nodes;
  std::vector<bool> is_child(model.nodes.size());
  for (const auto& node : model.nodes) {
    for (const int child : node.children) is_child.at(static_cast<std::size_t>(child)) = true;
  }
  std::vector<int> nodes;
  for (std::size_t i = 0; i < is_child.size(); ++i) {
    if (!is_child[i]) nodes.push_back(static_cast<int>(i));
  }
  return nodes;
}

}  // namespace

std::uint64_t component_bytes(Component c) {
  return c == Component::i8 || c == Component::u8 ? 1 : c == Component::i16 || c == Component::u16 ? 2 : 4;
}

void convert_geometry(const tinygltf::Model& model, Document& out, Findings& findings) {
  for (const auto& view : model.bufferViews) {
    out.views.push_back(convert_view(view, place_of("bufferViews", out.views.size()), findings));
  }
  for (const auto& accessor : model.accessors) {
    out.accessors.push_back(convert_accessor(accessor, place_of("accessors", out.accessors.size()), findings));
  }
  for (const auto& mesh : model.meshes) out.meshes.push_back(convert_mesh(mesh));
  for (const auto& node : model.nodes) {
    out.nodes.push_back(convert_node(node, place_of("nodes", out.nodes.size()), findings));
  }
  out.roots = roots_of(model);
  out.declares_quantization = std::find(model.extensionsUsed.begin(), model.extensionsUsed.end(),
                                        "KHR_mesh_quantization") != model.extensionsUsed.end();
}

}  // namespace kiln::gltf
