#include "core/artifact/glb.h"

#include <limits>

namespace kiln {
namespace {

constexpr std::uint32_t kMagic = 0x46546C67, kJson = 0x4E4F534A, kBinary = 0x004E4942;  // "glTF", "JSON", "BIN"
constexpr std::size_t kHeader = 12, kChunkHeader = 8;

void put_u32(Bytes& out, std::uint64_t value) {
  for (int shift = 0; shift < 32; shift += 8) out.push_back(static_cast<std::uint8_t>(value >> shift));
}

std::uint32_t get_u32(std::span<const std::uint8_t> file, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 4; i-- > 0;) value = value << 8 | file[at + i];
  return value;
}

tl::unexpected<Fault> damaged(const char* message) { return fault("not_a_baked_scene", message); }

}  // namespace

Result<Bytes> join_glb(std::string json, Bytes binary) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  binary.resize((binary.size() + 3) / 4 * 4, 0);
  const std::uint64_t total = kHeader + 2 * kChunkHeader + json.size() + binary.size();
  if (total > std::numeric_limits<std::uint32_t>::max()) {
    return fault("result_too_large", "The result passes the 4 GiB that a GLB can hold; ask for fewer triangles.");
  }
  Bytes out;
  out.reserve(total);
  for (const std::uint64_t word : {std::uint64_t{kMagic}, std::uint64_t{2}, total}) put_u32(out, word);
  put_u32(out, json.size());
  put_u32(out, kJson);
  out.insert(out.end(), json.begin(), json.end());
  put_u32(out, binary.size());
  put_u32(out, kBinary);
  out.insert(out.end(), binary.begin(), binary.end());
  return out;
}

Result<GlbChunks> split_glb(std::span<const std::uint8_t> file) {
  if (file.size() < kHeader || get_u32(file, 0) != kMagic) return damaged("This is not a GLB file.");
  if (get_u32(file, 4) != 2) return damaged("This is not version 2 of GLB.");
  if (get_u32(file, 8) > file.size()) return damaged("The file is shorter than its header says.");
  file = file.first(get_u32(file, 8));
  GlbChunks out;
  for (std::size_t at = kHeader; at + kChunkHeader <= file.size();) {
    const std::uint32_t length = get_u32(file, at), type = get_u32(file, at + 4);
    at += kChunkHeader;
    if (length > file.size() - at) return damaged("A chunk ends beyond the file.");
    const auto chunk = file.subspan(at, length);
    if (type == kJson && out.json.empty()) out.json = {reinterpret_cast<const char*>(chunk.data()), chunk.size()};
    if (type == kBinary && out.binary.empty()) out.binary = chunk;
    at += length;
  }
  if (out.json.empty()) return damaged("The file has no JSON chunk.");
  return out;
}

}  // namespace kiln
