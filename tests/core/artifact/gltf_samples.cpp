#include "tests/core/artifact/gltf_samples.h"

namespace kiln::test {
namespace {

void append_u32(Bytes& out, std::uint32_t x) {
  for (int i = 0; i < 4; ++i) out.push_back(static_cast<std::uint8_t>(x >> (8 * i)));
}

void append_chunk(Bytes& out, std::uint32_t type, Bytes data, std::uint8_t padding) {
  while (data.size() % 4 != 0) data.push_back(padding);
  append_u32(out, static_cast<std::uint32_t>(data.size()));
  append_u32(out, type);
  out.insert(out.end(), data.begin(), data.end());
}

void append_big_endian(Bytes& out, std::uint32_t x) {
  for (const int shift : {24, 16, 8, 0}) out.push_back(static_cast<std::uint8_t>(x >> shift));
}

}  // namespace

/// CRC-32 of the type and data, as PNG has it.
void append_png_chunk(Bytes& png, const std::string& type, const Bytes& data) {
  append_big_endian(png, static_cast<std::uint32_t>(data.size()));
  const std::size_t start = png.size();
  png.insert(png.end(), type.begin(), type.end());
  png.insert(png.end(), data.begin(), data.end());
  std::uint32_t crc = 0xFFFFFFFF;
  for (std::size_t i = start; i < png.size(); ++i) {
    crc ^= png[i];
    for (int k = 0; k < 8; ++k) crc = (crc & 1) != 0 ? crc >> 1 ^ 0xEDB88320 : crc >> 1;
  }
  append_big_endian(png, ~crc);
}

void append_bytes(Bytes& out, std::initializer_list<int> values) {
  for (const int x : values) out.push_back(static_cast<std::uint8_t>(x));
}

Bytes make_glb(const std::string& json, const Bytes& binary) {
  Bytes chunks;
  append_chunk(chunks, 0x4E4F534A, Bytes(json.begin(), json.end()), ' ');
  if (!binary.empty()) append_chunk(chunks, 0x004E4942, binary, 0);
  Bytes out;
  append_u32(out, 0x46546C67);
  append_u32(out, 2);
  append_u32(out, static_cast<std::uint32_t>(12 + chunks.size()));
  out.insert(out.end(), chunks.begin(), chunks.end());
  return out;
}

int Sample::add_view(std::size_t offset, std::size_t bytes, int stride, const std::string& extra) {
  if (view_count_ > 0) views_ += ",";
  views_ += "{\"buffer\":0,\"byteOffset\":" + std::to_string(offset) + ",\"byteLength\":" + std::to_string(bytes) +
            (stride > 0 ? ",\"byteStride\":" + std::to_string(stride) : std::string()) + extra + "}";
  return view_count_++;
}

int Sample::add_accessor(const std::string& members) {
  if (accessor_count_ > 0) accessors_ += ",";
  accessors_ += "{" + members + "}";
  return accessor_count_++;
}

std::string Sample::json(const std::string& rest) const {
  std::string out = "{\"asset\":{\"version\":\"2.0\"}";
  if (!blob_.bytes.empty()) out += ",\"buffers\":[{\"byteLength\":" + std::to_string(blob_.bytes.size()) + "}]";
  if (view_count_ > 0) out += ",\"bufferViews\":[" + views_ + "]";
  if (accessor_count_ > 0) out += ",\"accessors\":[" + accessors_ + "]";
  return out + (rest.empty() ? "" : "," + rest) + "}";
}

std::string one_node(const std::string& primitive, const std::string& node) {
  return "\"meshes\":[{\"primitives\":[{" + primitive + "}]}],\"nodes\":[{\"mesh\":0" +
         (node.empty() ? "" : "," + node) + "}],\"scenes\":[{\"nodes\":[0]}],\"scene\":0";
}

Result<Scene> import_bytes(const Bytes& file, const std::map<std::string, Bytes>& resources,
                           const ImportLimits& limits) {
  return import_scene({.name = "scene.glb", .main = file, .resources = resources}, limits);
}

Result<Scene> import_text(const std::string& json, const std::map<std::string, Bytes>& resources) {
  return import_bytes(Bytes(json.begin(), json.end()), resources);
}

std::vector<float> cube_positions() {
  std::vector<float> out;
  for (int i = 0; i < 8; ++i) {
    for (int axis = 0; axis < 3; ++axis) out.push_back((i >> axis & 1) != 0 ? 1.0F : -1.0F);
  }
  return out;
}

std::vector<std::uint32_t> cube_indices() {
  return {0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6};
}

bool has_warning(const Scene& scene, const std::string& code) {
  for (const Warning& warning : scene.warnings) {
    if (warning.code == code) return true;
  }
  return false;
}

Bytes png_header_only(std::uint32_t width, std::uint32_t height) {
  Bytes out{0x89, 'P', 'N', 'G', 0x0D, 0x0A, 0x1A, 0x0A};
  Bytes header;
  append_big_endian(header, width);
  append_big_endian(header, height);
  append_bytes(header, {8, 6, 0, 0, 0});  // RGBA of 8 bits, not interlaced
  append_png_chunk(out, "IHDR", header);
  return out;
}

Bytes zlib_stored(const Bytes& data) {
  const auto size = static_cast<int>(data.size());
  Bytes out;
  append_bytes(out, {0x78, 0x01, 0x01, size & 255, size >> 8, ~size & 255, ~size >> 8 & 255});
  out.insert(out.end(), data.begin(), data.end());
  std::uint32_t a = 1, b = 0;
  for (const std::uint8_t x : data) {
    a = (a + x) % 65521;
    b = (b + a) % 65521;
  }
  append_big_endian(out, b << 16 | a);
  return out;
}

Bytes tiny_png() {
  Bytes out = png_header_only(2, 2);
  append_png_chunk(out, "IDAT",
                   zlib_stored({0, 255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 0, 255, 255, 255, 255, 255, 255}));
  append_png_chunk(out, "IEND", {});
  return out;
}

std::string base64(const Bytes& bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k) bits = bits << 8 | (i + k < bytes.size() ? bytes[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k) out += i + k <= bytes.size() ? kDigits[bits >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}

}  // namespace kiln::test
