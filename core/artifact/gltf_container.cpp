#include "core/artifact/gltf_container.h"

#include <string>

namespace kiln {
namespace {

using Span = std::span<const std::uint8_t>;

constexpr std::uint32_t kMagic = 0x46546C67, kJsonChunk = 0x4E4F534A, kBinChunk = 0x004E4942;
constexpr std::size_t kHeaderBytes = 12, kChunkHeaderBytes = 8;

std::uint32_t read_u32(Span bytes, std::size_t at) {
  std::uint32_t x = 0;
  for (std::size_t i = 4; i-- > 0;) x = (x << 8) | bytes[at + i];
  return x;
}

Span without_mark(Span file) {
  return file.size() >= 3 && file[0] == 0xEF && file[1] == 0xBB && file[2] == 0xBF ? file.subspan(3) : file;
}

std::string byte_place(std::size_t at) { return "byte " + std::to_string(at); }

bool check_header(Span file, Findings& findings) {
  if (file.size() < kHeaderBytes) {
    findings.fail("glb_truncated", "The GLB header is cut off.", byte_place(file.size()));
  } else if (read_u32(file, 4) != 2) {
    findings.fail("unsupported_version", "GLB version " + std::to_string(read_u32(file, 4)) + " is not 2.",
                  byte_place(4));
  } else if (read_u32(file, 8) != file.size()) {
    findings.fail("glb_length_mismatch",
                  "The header says " + std::to_string(read_u32(file, 8)) + " bytes, the file has " +
                      std::to_string(file.size()) + ".",
                  byte_place(8));
  }
  return !findings.failed();
}

/// Takes chunk number `index`, of `type`, into the container.
void take_chunk(GltfContainer& container, std::size_t index, std::uint32_t type, Span data, std::size_t at,
                Findings& findings) {
  if (index == 0 && type != kJsonChunk) {
    findings.fail("glb_chunk_order", "The first chunk must be JSON.", byte_place(at));
  } else if (index > 0 && type == kJsonChunk) {
    findings.fail("glb_duplicate_chunk", "There is a second JSON chunk.", byte_place(at));
  } else if (type == kBinChunk && container.has_binary) {
    findings.fail("glb_duplicate_chunk", "There is a second BIN chunk.", byte_place(at));
  } else if (type == kBinChunk && index != 1) {
    findings.fail("glb_chunk_order", "The BIN chunk must be the second.", byte_place(at));
  } else if (type == kJsonChunk) {
    container.json = data;
  } else if (type == kBinChunk) {
    container.binary = data;
    container.has_binary = true;
  }
}

}  // namespace

bool looks_like_glb(Span file) { return file.size() >= 4 && read_u32(file, 0) == kMagic; }

bool looks_like_json(Span file) {
  for (const std::uint8_t c : without_mark(file)) {
    if (c == ' ' || c == '\t' || c == '\n' || c == '\r') continue;
    return c == '{';
  }
  return false;
}

GltfContainer open_glb(Span file, Findings& findings) {
  GltfContainer container;
  if (!check_header(file, findings)) return container;
  std::size_t at = kHeaderBytes;
  for (std::size_t index = 0; at < file.size() && !findings.failed(); ++index) {
    if (file.size() - at < kChunkHeaderBytes) {
      findings.fail("glb_truncated", "A chunk header is cut off.", byte_place(at));
      break;
    }
    const std::size_t length = read_u32(file, at);
    if (length > file.size() - at - kChunkHeaderBytes) {
      findings.fail("glb_chunk_out_of_bounds",
                    "A chunk of " + std::to_string(length) + " bytes passes the end of the file, " +
                        std::to_string(file.size() - at - kChunkHeaderBytes) + " are left.",
                    byte_place(at));
      break;
    }
    take_chunk(container, index, read_u32(file, at + 4), file.subspan(at + kChunkHeaderBytes, length), at, findings);
    at += kChunkHeaderBytes + length;
  }
  if (container.json.empty()) findings.fail("glb_no_json", "There is no JSON chunk.", byte_place(at));
  return container;
}

GltfContainer open_gltf(Span file, Findings& findings) {
  const Span json = without_mark(file);
  if (json.size() != file.size())
    findings.warn("json_byte_order_mark", "glTF forbids a byte-order mark; it is skipped.");
  return {.json = json};
}

}  // namespace kiln
