#include "core/artifact/gltf_placement.h"

#include <algorithm>
#include <cmath>

#include "core/artifact/assemble.h"
#include "core/artifact/gltf_check.h"
#include "core/artifact/gltf_primitive.h"

namespace kiln::gltf {
namespace {

constexpr double kMaxTransform = 1e30;

struct Visit {
  int node;
  int depth;
  Affine parent;
};

bool sane(const Affine& m) {
  const auto small = [](const Vec3d& v) {
    return std::abs(v.x) < kMaxTransform && std::abs(v.y) < kMaxTransform && std::abs(v.z) < kMaxTransform;
  };
  return is_finite(m) && small(m.x) && small(m.y) && small(m.z) && small(m.t);
}

Affine local_of(const Node& node) {
  const auto& m = node.matrix;
  return {{m[0], m[1], m[2]}, {m[4], m[5], m[6]}, {m[8], m[9], m[10]}, {m[12], m[13], m[14]}};
}

Affine from_trs(const Vec3d& t, const std::array<double, 4>& q, const Vec3d& s) {
  const double x = q[0], y = q[1], z = q[2], w = q[3];
  return {Vec3d{1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)} * s.x,
          Vec3d{2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)} * s.y,
          Vec3d{2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)} * s.z, t};
}

/// An instancing attribute, or nothing if the node does not have it.
std::vector<float> instance_values(const AccessorSource& source, const Node& node, const char* name,
                                   std::uint64_t width, const std::string& place, Findings& findings) {
  const auto at = node.instancing.find(name);
  if (at == node.instancing.end()) return {};
  if (source.document.accessors[static_cast<std::size_t>(at->second)].width != width) {
    findings.fail("accessor_type", "The number of components does not fit the attribute.", place + name);
    return {};
  }
  return read_floats(source, at->second, place + name, findings);
}

std::uint64_t instance_count(const Document& d, const Node& node) {
  if (!node.instanced) return 1;
  return node.instancing.empty() ? 0 : d.accessors[static_cast<std::size_t>(node.instancing.begin()->second)].count;
}

std::array<double, 4> unit_quaternion(const float* q) {
  const double norm = std::sqrt(double{q[0]} * q[0] + double{q[1]} * q[1] + double{q[2]} * q[2] + double{q[3]} * q[3]);
  if (!(norm > 0)) return {0, 0, 0, 1};
  return {q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm};
}

std::vector<Affine> expand(const AccessorSource& source, const Node& node, const Affine& world, int index,
                           Findings& findings) {
  if (!node.instanced) return {world};
  const std::string place = "/nodes/" + std::to_string(index) + "/extensions/EXT_mesh_gpu_instancing/attributes/";
  const std::uint64_t count = instance_count(source.document, node);
  for (const auto& [name, accessor] : node.instancing) {
    if (source.document.accessors[static_cast<std::size_t>(accessor)].count != count) {
      findings.fail("attribute_count_mismatch", "Instance attributes differ in count.", place + name);
    }
  }
  if (findings.failed()) return {};
  const auto t = instance_values(source, node, "TRANSLATION", 3, place, findings);
  const auto r = instance_values(source, node, "ROTATION", 4, place, findings);
  const auto s = instance_values(source, node, "SCALE", 3, place, findings);
  if (findings.failed()) return {};
  std::vector<Affine> out;
  out.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3d move = t.empty() ? Vec3d{} : Vec3d{t[3 * i], t[3 * i + 1], t[3 * i + 2]};
    const Vec3d scale = s.empty() ? Vec3d{1, 1, 1} : Vec3d{s[3 * i], s[3 * i + 1], s[3 * i + 2]};
    const auto turn = r.empty() ? std::array<double, 4>{0, 0, 0, 1} : unit_quaternion(r.data() + 4 * i);
    out.push_back(world * from_trs(move, turn, scale));
  }
  return out;
}

PlacedLight placed(const Light& light, const Affine& world) {
  PlacedLight out{.light = light, .position = world.t};
  out.light.direction = to_float(normalized(-world.z, Vec3d{0, 0, -1}));
  return out;
}

/// Upper bounds over all primitives with surface of a mesh.
PrimitiveSize mesh_size(const Document& d, const Mesh& mesh) {
  PrimitiveSize sum;
  for (const Primitive& p : mesh.primitives) {
    if (!has_surface(p)) continue;
    const PrimitiveSize one = predicted_size(d, p);
    sum.vertices += one.vertices;
    sum.triangles += one.triangles;
  }
  return sum;
}

std::uint64_t whole(double x) { return static_cast<std::uint64_t>(std::min(x, 1e15)); }

/// The forest in document order, with world transforms.
class Walk {
 public:
  Walk(const AccessorSource& source, const ImportLimits& limits, Findings& findings)
      : source_(source), limits_(limits), findings_(findings) {
    const RadianceDeclaration& radiance = source.document.radiance;
    if (radiance) row_ = 3 * sizeof(float) * (radiance.degree + 1) * (radiance.degree + 1);
    for (const Mesh& mesh : source.document.meshes) sizes_.push_back(mesh_size(source.document, mesh));
  }

  Placements run() {
    push(source_.document.roots, 1, Affine{});
    while (!stack_.empty() && !findings_.failed()) {
      const Visit visit = stack_.back();
      stack_.pop_back();
      enter(visit);
    }
    return std::move(out_);
  }

 private:
  void push(const std::vector<int>& nodes, int depth, const Affine& parent) {
    for (auto node = nodes.rbegin(); node != nodes.rend(); ++node) stack_.push_back({*node, depth, parent});
  }

  void enter(const Visit& visit) {
    const Node& node = source_.document.nodes[static_cast<std::size_t>(visit.node)];
    const std::string place = "/nodes/" + std::to_string(visit.node);
    const auto& m = node.matrix;
    if (visit.depth > kMaxNodeDepth) {
      return findings_.fail("node_too_deep",
                            "Nodes are nested deeper than " + std::to_string(kMaxNodeDepth) + " levels.", place);
    }
    const Affine world = visit.parent * local_of(node);
    if (!sane(world) || m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1) {
      return findings_.fail("node_transform_invalid", "The transform is not finite or not affine.", place);
    }
    if (node.light >= 0)
      out_.lights.push_back(placed(source_.document.lights[static_cast<std::size_t>(node.light)], world));
    if (node.mesh >= 0) place_mesh(node, visit.node, world);
    push(node.children, visit.depth + 1, world);
  }

  void place_mesh(const Node& node, int index, const Affine& world) {
    const PrimitiveSize& size = sizes_[static_cast<std::size_t>(node.mesh)];
    if (size.triangles == 0) return;
    const std::uint64_t count = instance_count(source_.document, node);
    vertices_ += static_cast<double>(size.vertices) * static_cast<double>(count);
    triangles_ += static_cast<double>(size.triangles) * static_cast<double>(count);
    check_expanded_size(whole(vertices_), whole(triangles_), row_, limits_, findings_);
    if (findings_.failed()) return;
    out_.meshes.push_back(
        {.node = index, .mesh = node.mesh, .instances = expand(source_, node, world, index, findings_)});
    for (const Affine& instance : out_.meshes.back().instances) {
      if (!sane(instance)) {
        return findings_.fail("node_transform_invalid", "The transform of an instance is not finite.",
                              "/nodes/" + std::to_string(index));
      }
    }
  }

  const AccessorSource& source_;
  const ImportLimits& limits_;
  Findings& findings_;
  std::vector<PrimitiveSize> sizes_;
  std::vector<Visit> stack_;
  std::uint64_t row_ = 0;                // bytes of radiance of a vertex
  double vertices_ = 0, triangles_ = 0;  // no product of three counts overflows a double
  Placements out_;
};

}  // namespace

Placements place_nodes(const AccessorSource& source, const ImportLimits& limits, Findings& findings) {
  return Walk(source, limits, findings).run();
}

}  // namespace kiln::gltf
