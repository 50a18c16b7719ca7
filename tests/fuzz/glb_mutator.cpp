// Mutations that a GLB survives: its JSON or its binary chunk is changed and the lengths are put right, so that inputs
// reach what lies behind the container. Every eighth time the file is changed as it is, lengths and all.

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <vector>

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace {

constexpr std::size_t kHeader = 12, kChunk = 8;

std::uint32_t number_at(const std::uint8_t* p) {
  std::uint32_t n = 0;
  std::memcpy(&n, p, 4);
  return n;
}

void put_number(std::vector<std::uint8_t>& out, std::size_t n) {
  for (int shift = 0; shift < 32; shift += 8) out.push_back(static_cast<std::uint8_t>(n >> shift));
}

void put_chunk(std::vector<std::uint8_t>& out, std::uint32_t type, std::vector<std::uint8_t> bytes, std::uint8_t pad) {
  while (bytes.size() % 4 != 0) bytes.push_back(pad);
  put_number(out, bytes.size());
  put_number(out, type);
  out.insert(out.end(), bytes.begin(), bytes.end());
}

/// Up to 64 bytes somewhere change, or, one time in four, anything of the chunk.
void mutate(std::vector<std::uint8_t>& bytes, std::size_t room, unsigned seed) {
  const std::size_t size = bytes.size();
  const std::size_t begin = seed % 4 == 0 || size == 0 ? 0 : (seed / 4) % size;
  const std::size_t length = begin == 0 ? size : std::min<std::size_t>(64, size - begin);
  std::vector<std::uint8_t> part(bytes.begin() + static_cast<std::ptrdiff_t>(begin),
                                 bytes.begin() + static_cast<std::ptrdiff_t>(begin + length));
  part.resize(length + std::min<std::size_t>(room, 256));
  part.resize(LLVMFuzzerMutate(part.data(), length, part.size()));
  const auto at = bytes.erase(bytes.begin() + static_cast<std::ptrdiff_t>(begin),
                              bytes.begin() + static_cast<std::ptrdiff_t>(begin + length));
  bytes.insert(at, part.begin(), part.end());
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned seed) {
  const bool glb = size >= kHeader + kChunk && std::memcmp(data, "glTF", 4) == 0;
  const std::size_t json_bytes = glb ? number_at(data + kHeader) : 0;
  const std::size_t binary_at = kHeader + kChunk + json_bytes + kChunk;
  if (!glb || seed % 8 == 0 || binary_at > size) return LLVMFuzzerMutate(data, size, max_size);
  std::vector<std::uint8_t> json(data + kHeader + kChunk, data + kHeader + kChunk + json_bytes);
  std::vector<std::uint8_t> binary(data + binary_at, data + size);
  const std::size_t room = max_size > size + 8 ? max_size - size - 8 : 0;
  mutate(seed / 8 % 2 == 0 ? json : binary, room, seed / 16);
  std::vector<std::uint8_t> out = {'g', 'l', 'T', 'F', 2, 0, 0, 0};
  put_number(out, 0);
  put_chunk(out, 0x4E4F534A, std::move(json), ' ');
  put_chunk(out, 0x004E4942, std::move(binary), 0);
  if (out.size() > max_size) return LLVMFuzzerMutate(data, size, max_size);
  const auto length = static_cast<std::uint32_t>(out.size());
  std::memcpy(out.data() + 8, &length, 4);
  std::copy(out.begin(), out.end(), data);
  return out.size();
}
