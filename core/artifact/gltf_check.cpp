#include "core/artifact/gltf_check.h"

#include <algorithm>
#include <string_view>

namespace kiln::gltf {
namespace {

/// Elements that no bytes stand for (zeros) must not be able to claim the memory.
constexpr std::uint64_t kMaxZeroElements = 8u << 20;

std::string accessor_place(std::size_t i) { return "/accessors/" + std::to_string(i); }

/// An index that may be absent, and one that may not.
bool may(int index, const auto& array) { return index >= -1 && index < static_cast<int>(array.size()); }
bool must(int index, const auto& array) { return index >= 0 && may(index, array); }

bool all(const std::vector<int>& indices, const auto& array) {
  return std::all_of(indices.begin(), indices.end(), [&](int i) { return must(i, array); });
}
bool all(const std::map<std::string, int>& indices, const auto& array) {
  return std::all_of(indices.begin(), indices.end(), [&](const auto& named) { return must(named.second, array); });
}

bool holds(const Document& d, const BufferView& v) {
  return must(v.buffer, d.buffers) && (v.meshopt.mode == MeshoptMode::none || must(v.meshopt.buffer, d.buffers));
}
bool holds(const Document& d, const Accessor& a) {
  return may(a.view, d.views) && a.width > 0 &&
         (a.sparse.count == 0 || (must(a.sparse.index_view, d.views) && must(a.sparse.value_view, d.views)));
}
bool holds(const Document& d, const Mesh& m) {
  return std::all_of(m.primitives.begin(), m.primitives.end(), [&](const Primitive& p) {
    return all(p.attributes, d.accessors) && may(p.indices, d.accessors) && may(p.material, d.materials) &&
           may(p.draco.view, d.views);
  });
}
bool holds(const Document& d, const Node& n) {
  return all(n.children, d.nodes) && may(n.mesh, d.meshes) && may(n.light, d.lights) && all(n.instancing, d.accessors);
}
bool holds(const Document& d, const ImageSource& i) { return may(i.view, d.views); }
bool holds(const Document& d, const Texture& t) { return may(t.image, d.images); }
bool holds(const Document& d, const Material& m) {
  return may(m.base_color_texture.texture, d.textures) && may(m.emission_texture.texture, d.textures) &&
         may(m.normal_texture.texture, d.textures) && may(m.metallic_roughness_texture.texture, d.textures);
}

bool all_hold(const Document& d, const auto& array) {
  return std::all_of(array.begin(), array.end(), [&](const auto& element) { return holds(d, element); });
}

/// offset + stride * (count - 1) + element <= view, without overflow: all terms are below 2^53 or checked first.
void check_range(const Document& d, int view, std::uint64_t offset, std::uint64_t stride, std::uint64_t count,
                 std::uint64_t element, const std::string& place, Findings& findings) {
  const std::uint64_t bytes = d.views[static_cast<std::size_t>(view)].bytes;
  const std::uint64_t needed = stride * (count - 1) + element;
  if (offset <= bytes && needed <= bytes - offset) return;
  findings.fail("accessor_out_of_bounds",
                "Bytes " + std::to_string(offset) + " + " + std::to_string(needed) + " pass the end of the view at " +
                    std::to_string(bytes) + ".",
                place);
}

void check_sparse(const Document& d, const Accessor& a, std::size_t i, Findings& findings) {
  if (a.sparse.count == 0) return;
  const Sparse& s = a.sparse;
  const std::string place = accessor_place(i) + "/sparse";
  const std::uint64_t index_bytes = component_bytes(s.index_component);
  check_range(d, s.index_view, s.index_offset, index_bytes, s.count, index_bytes, place + "/indices", findings);
  check_range(d, s.value_view, s.value_offset, a.element_bytes(), s.count, a.element_bytes(), place + "/values",
              findings);
}

void check_accessor(const Document& d, std::size_t i, Findings& findings) {
  const Accessor& a = d.accessors[i];
  check_sparse(d, a, i, findings);
  if (a.view < 0) return;
  const std::uint64_t stride = stride_of(a, d);
  if (!a.matrix && stride < a.element_bytes()) {
    findings.fail("view_stride", "The stride is smaller than an element.", accessor_place(i));
    return;
  }
  if (stride % component_bytes(a.component) != 0 || a.offset % component_bytes(a.component) != 0) {
    findings.warn("accessor_unaligned", "Elements do not start at multiples of their component size.",
                  accessor_place(i));
  }
  if (!a.matrix) check_range(d, a.view, a.offset, stride, a.count, a.element_bytes(), accessor_place(i), findings);
}

/// Every attribute has as many elements as the first one.
void check_primitive(const Document& d, const Primitive& p, const std::string& place, Findings& findings) {
  std::uint64_t count = 0;
  for (const auto& [name, index] : p.attributes) {
    const Accessor& a = d.accessors[static_cast<std::size_t>(index)];
    if (count == 0) count = a.count;
    if (a.count != count) {
      findings.fail("attribute_count_mismatch",
                    std::to_string(a.count) + " elements, another attribute has " + std::to_string(count) + ".",
                    place + "/attributes/" + name);
    }
    const bool has_bytes = a.view >= 0 || p.draco.view >= 0;
    if (!has_bytes && a.count > kMaxZeroElements) {
      findings.fail("accessor_without_data",
                    "An accessor of " + std::to_string(a.count) + " elements has no buffer view.",
                    place + "/attributes/" + name);
    }
  }
  if (p.indices < 0) return;
  const Accessor& indices = d.accessors[static_cast<std::size_t>(p.indices)];
  const bool is_unsigned =
      indices.component == Component::u8 || indices.component == Component::u16 || indices.component == Component::u32;
  if (!is_unsigned || indices.width != 1) {
    findings.fail("accessor_type", "Indices must be unsigned scalars.", place + "/indices");
  } else if (indices.view < 0 && p.draco.view < 0 && indices.count > kMaxZeroElements) {
    findings.fail("accessor_without_data",
                  "An accessor of " + std::to_string(indices.count) + " elements has no buffer view.",
                  place + "/indices");
  }
}

/// Every node has at most one parent, none is its own ancestor, and scenes list roots once: a walk from
/// the roots then meets every node at most once.
void check_forest(const Document& d, Findings& findings) {
  std::vector<int> parent(d.nodes.size(), -1);
  for (std::size_t i = 0; i < d.nodes.size(); ++i) {
    for (const int child : d.nodes[i].children) {
      int& p = parent[static_cast<std::size_t>(child)];
      if (child == static_cast<int>(i)) {
        return findings.fail("node_cycle", "A node is its own child.", "/nodes/" + std::to_string(i));
      }
      if (p >= 0) {
        return findings.fail("node_multiple_parents", "A node is listed as a child twice.",
                             "/nodes/" + std::to_string(child));
      }
      p = static_cast<int>(i);
    }
  }
  std::vector<int> mark(d.nodes.size(), -1);  // the walk that came here first
  for (int i = 0; i < static_cast<int>(d.nodes.size()); ++i) {
    for (int at = i; at >= 0 && (mark[static_cast<std::size_t>(at)] < 0); at = parent[static_cast<std::size_t>(at)]) {
      mark[static_cast<std::size_t>(at)] = i;
      const int next = parent[static_cast<std::size_t>(at)];
      if (next >= 0 && mark[static_cast<std::size_t>(next)] == i) {
        return findings.fail("node_cycle", "A node is its own ancestor.", "/nodes/" + std::to_string(next));
      }
    }
  }
  std::vector<bool> listed(d.nodes.size());
  for (const int root : d.roots) {
    if (parent[static_cast<std::size_t>(root)] >= 0 || listed[static_cast<std::size_t>(root)]) {
      return findings.fail("scene_root_invalid", "A scene lists a node that is a child, or lists it twice.",
                           "/nodes/" + std::to_string(root));
    }
    listed[static_cast<std::size_t>(root)] = true;
  }
}

}  // namespace

std::uint64_t stride_of(const Accessor& a, const Document& d) {
  const std::uint64_t stride = a.view >= 0 ? d.views[static_cast<std::size_t>(a.view)].stride : 0;
  return stride > 0 ? stride : a.element_bytes();
}

bool indices_hold(const Document& d) {
  return all_hold(d, d.views) && all_hold(d, d.accessors) && all_hold(d, d.meshes) && all_hold(d, d.nodes) &&
         all_hold(d, d.images) && all_hold(d, d.textures) && all_hold(d, d.materials) && all(d.roots, d.nodes);
}

void check_document(const Document& d, Findings& findings) {
  for (std::size_t i = 0; i < d.accessors.size() && !findings.failed(); ++i) check_accessor(d, i, findings);
  for (std::size_t m = 0; m < d.meshes.size() && !findings.failed(); ++m) {
    for (std::size_t p = 0; p < d.meshes[m].primitives.size(); ++p) {
      check_primitive(d, d.meshes[m].primitives[p], "/meshes/" + std::to_string(m) + "/primitives/" + std::to_string(p),
                      findings);
    }
  }
  if (!findings.failed()) check_forest(d, findings);
}

}  // namespace kiln::gltf
