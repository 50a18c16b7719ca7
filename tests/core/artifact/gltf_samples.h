#pragma once
// Small glTF files made in memory, for the tests of the importer.

#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <map>
#include <string>
#include <vector>

#include "core/artifact/import.h"

namespace kiln::test {

/// Collects binary data, aligned to 4 bytes.
struct Blob {
  Bytes bytes;

  /// Returns the offset of the values.
  template <class T>
  std::size_t add(const std::vector<T>& values) {
    while (bytes.size() % 4 != 0) bytes.push_back(0);
    const std::size_t at = bytes.size();
    bytes.resize(at + values.size() * sizeof(T));
    if (!values.empty()) std::memcpy(bytes.data() + at, values.data(), values.size() * sizeof(T));
    return at;
  }
};

/// Adds these values as bytes.
void append_bytes(Bytes&, std::initializer_list<int> values);

Bytes make_glb(const std::string& json, const Bytes& binary);

/// A mesh by its accessors: collects views and accessors as JSON while data is added.
class Sample {
 public:
  /// Adds an accessor over new data; `extra` is more JSON of the accessor, as in ",\"normalized\":true".
  template <class T>
  int accessor(const std::vector<T>& values, int component, const std::string& type, std::size_t count,
               const std::string& extra = {}, int stride = 0) {
    const std::size_t at = blob_.add(values);
    const int view = add_view(at, values.size() * sizeof(T), stride);
    return add_accessor("\"bufferView\":" + std::to_string(view) + ",\"componentType\":" + std::to_string(component) +
                        ",\"count\":" + std::to_string(count) + ",\"type\":\"" + type + "\"" + extra);
  }
  int add_view(std::size_t offset, std::size_t bytes, int stride = 0, const std::string& extra = {});
  int add_accessor(const std::string& members);
  int positions(const std::vector<float>& xyz) { return accessor(xyz, 5126, "VEC3", xyz.size() / 3); }
  int normals(const std::vector<float>& xyz) { return positions(xyz); }
  int indices(const std::vector<std::uint32_t>& values) { return accessor(values, 5125, "SCALAR", values.size()); }

  /// The JSON, with `rest` holding meshes, nodes and what else is wanted, as in "\"meshes\":[...]".
  std::string json(const std::string& rest) const;
  Bytes glb(const std::string& rest) const { return make_glb(json(rest), blob_.bytes); }
  Blob& blob() { return blob_; }

 private:
  Blob blob_;
  std::string views_, accessors_;
  int view_count_ = 0, accessor_count_ = 0;
};

/// Meshes and nodes for one primitive at one node: `primitive` is its JSON members, `node` more members of the node.
std::string one_node(const std::string& primitive, const std::string& node = {});

/// Imports a GLB, or JSON text, under the name "scene.glb".
Result<Scene> import_bytes(const Bytes& file, const std::map<std::string, Bytes>& resources = {},
                           const ImportLimits& limits = {});
Result<Scene> import_text(const std::string& json, const std::map<std::string, Bytes>& resources = {});

/// A right triangle in the plane z = 0, facing +Z.
inline const std::vector<float> kTriangle{0, 0, 0, 1, 0, 0, 0, 1, 0};

/// A closed cube from -1 to 1: 8 shared positions, 12 triangles wound outwards.
std::vector<float> cube_positions();
std::vector<std::uint32_t> cube_indices();

/// Whether the scene carries a warning of this code.
bool has_warning(const Scene&, const std::string& code);

/// The signature and IHDR of a PNG of this size, nothing more; and a real one of 2 x 2 pixels: red, green / blue,
/// white.
Bytes png_header_only(std::uint32_t width, std::uint32_t height);
Bytes tiny_png();
void append_png_chunk(Bytes& png, const std::string& type, const Bytes& data);

/// At most 65535 bytes as a zlib stream of one stored block.
Bytes zlib_stored(const Bytes& data);

std::string base64(const Bytes&);

}  // namespace kiln::test
