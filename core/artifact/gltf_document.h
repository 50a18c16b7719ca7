#pragma once
// A glTF document as plain structs: every index in range (or -1), every enum known, every number finite.
// Byte ranges are checked by check_document (gltf_check.h).

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/lightfield/radiance_function.h"
#include "core/scene/scene.h"

namespace kiln::gltf {

struct Buffer {
  std::uint64_t bytes = 0;
  std::string uri;
  bool has_uri = false;
  bool fallback = false;  // EXT_meshopt_compression: has no bytes of its own
};

enum class MeshoptMode { none, attributes, triangles, indices };
enum class MeshoptFilter { none, octahedral, quaternion, exponential };

struct Meshopt {
  MeshoptMode mode = MeshoptMode::none;
  MeshoptFilter filter = MeshoptFilter::none;
  int buffer = -1;
  std::uint64_t offset = 0, bytes = 0, stride = 0, count = 0;
};

struct BufferView {
  int buffer = -1;
  std::uint64_t offset = 0, bytes = 0;
  std::uint64_t stride = 0;  // 0: tightly packed
  Meshopt meshopt;
};

enum class Component { i8 = 5120, u8 = 5121, i16 = 5122, u16 = 5123, u32 = 5125, f32 = 5126 };
std::uint64_t component_bytes(Component);

struct Sparse {
  std::uint64_t count = 0;  // 0: not sparse
  int index_view = -1, value_view = -1;
  Component index_component = Component::u32;
  std::uint64_t index_offset = 0, value_offset = 0;
};

struct Accessor {
  int view = -1;  // -1: zeros
  std::uint64_t offset = 0, count = 0;
  Component component = Component::f32;
  bool normalized = false;
  std::uint64_t width = 1;  // components of an element
  bool matrix = false;
  Sparse sparse;
  std::vector<double> min, max;  // empty if absent

  std::uint64_t element_bytes() const { return width * component_bytes(component); }
};

struct DracoData {
  int view = -1;                          // -1: not compressed
  std::map<std::string, int> attributes;  // name -> unique id
};

enum class Mode { points, lines, line_loop, line_strip, triangles, triangle_strip, triangle_fan };

struct Primitive {
  std::map<std::string, int> attributes;
  int indices = -1, material = -1;
  Mode mode = Mode::triangles;
  bool morphed = false;
  DracoData draco;

  int attribute(const char* name) const {
    const auto at = attributes.find(name);
    return at == attributes.end() ? -1 : at->second;
  }
};

struct Mesh {
  std::string name;
  std::vector<Primitive> primitives;
};

struct Node {
  std::string name;
  std::vector<int> children;
  int mesh = -1, light = -1;
  bool skinned = false;
  std::array<double, 16> matrix{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};  // column-major, from TRS if so given
  bool instanced = false;
  std::map<std::string, int> instancing;  // TRANSLATION, ROTATION, SCALE accessors
};

struct ImageSource {
  std::string name, uri, mime;
  bool has_uri = false;
  int view = -1;
};

/// KILN_radiance_functions: what the attributes _RF_n of primitives are (carried.md).
struct RadianceDeclaration {
  std::uint64_t version = 0;  // 0: there is none
  RadianceBasis basis = RadianceBasis::harmonics;
  std::uint64_t degree = 0;
  bool reflected = false;

  explicit operator bool() const { return version > 0; }
  std::size_t count() const { return radiance_count(basis, static_cast<int>(degree)); }
};

struct Document {
  std::vector<Buffer> buffers;
  std::vector<BufferView> views;
  std::vector<Accessor> accessors;
  std::vector<Mesh> meshes;
  std::vector<Node> nodes;
  std::vector<ImageSource> images;
  std::vector<Texture> textures;
  std::vector<Material> materials;
  std::vector<Light> lights;  // intensity as written; position and direction come from nodes
  std::vector<int> roots;     // of the default scene
  bool declares_quantization = false;
  RadianceDeclaration radiance;
};

}  // namespace kiln::gltf
