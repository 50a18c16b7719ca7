#include "core/artifact/draco_header.h"

#include <cstring>

namespace kiln {
namespace {

/// Reads forward; after the end everything is zero and `good` false.
struct Reader {
  std::span<const std::uint8_t> bytes;
  bool good = true;

  std::uint8_t u8() {
    if (bytes.empty()) {
      good = false;
      return 0;
    }
    const std::uint8_t x = bytes.front();
    bytes = bytes.subspan(1);
    return x;
  }
  std::uint64_t varint() {
    std::uint64_t x = 0;
    for (int shift = 0; shift < 35; shift += 7) {
      const std::uint8_t byte = u8();
      x |= static_cast<std::uint64_t>(byte & 0x7F) << shift;
      if ((byte & 0x80) == 0) return x;
    }
    good = false;
    return 0;
  }
  void skip(std::uint64_t n) {
    good = good && n <= bytes.size();
    bytes = good ? bytes.subspan(n) : std::span<const std::uint8_t>{};
  }
};

/// Names and values, then nested ones; at most `depth` levels are believed.
void skip_metadata(Reader& in, int depth) {
  if (depth == 0) in.good = false;
  const std::uint64_t entries = in.good ? in.varint() : 0;
  for (std::uint64_t i = 0; i < entries && in.good; ++i) {
    in.skip(in.u8());
    in.skip(in.varint());
  }
  const std::uint64_t children = in.good ? in.varint() : 0;
  for (std::uint64_t i = 0; i < children && in.good; ++i) {
    in.skip(in.u8());
    skip_metadata(in, depth - 1);
  }
}

void skip_geometry_metadata(Reader& in) {
  constexpr int kMaxDepth = 8;
  const std::uint64_t attributes = in.varint();
  for (std::uint64_t i = 0; i < attributes && in.good; ++i) {
    in.varint();
    skip_metadata(in, kMaxDepth);
  }
  skip_metadata(in, kMaxDepth);
}

}  // namespace

std::optional<DracoHeader> read_draco_header(std::span<const std::uint8_t> stream) {
  constexpr std::size_t kFixedBytes = 11;
  constexpr std::uint8_t kMesh = 1, kSequential = 0, kEdgebreaker = 1;
  if (stream.size() < kFixedBytes || std::memcmp(stream.data(), "DRACO", 5) != 0) return std::nullopt;
  if (stream[5] != 2 || stream[6] != 2 || stream[7] != kMesh || stream[8] > kEdgebreaker) return std::nullopt;
  const bool has_metadata = (stream[10] & 0x80) != 0;
  Reader in{stream.subspan(kFixedBytes)};
  if (has_metadata) skip_geometry_metadata(in);
  DracoHeader header{.sequential = stream[8] == kSequential};
  if (header.sequential) {
    header.faces = in.varint();
    header.vertices = in.varint();
  } else {
    in.u8();  // kind of traversal
    header.vertices = in.varint();
    header.faces = in.varint();
  }
  if (!in.good) return std::nullopt;
  return header;
}

}  // namespace kiln
