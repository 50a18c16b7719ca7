// Runs a fuzz target over files and folders, without libFuzzer: seeds, and inputs that once broke something.
//   fuzz_scene_replay FILE|FOLDER ...      exit 1 when there was nothing to read
//
// Every file is read whole, cut at 16 places, and with one byte changed at 64 places: cheap, and the same every time.

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "tests/fuzz/target.h"

namespace {

using Input = std::vector<std::uint8_t>;

Input bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return Input(std::istreambuf_iterator<char>(file), {});
}

/// In memory of exactly its size, so that a sanitizer sees a read beyond it.
int run(const Input& input) {
  const Input exact(input.begin(), input.end());
  return LLVMFuzzerTestOneInput(exact.data(), exact.size());
}

void run_variants(const Input& input) {
  run(input);
  for (std::size_t i = 0; i < 16; ++i)
    run({input.begin(), input.begin() + static_cast<std::ptrdiff_t>(input.size() * i / 16)});
  for (std::size_t i = 0; i < 64 && !input.empty(); ++i) {
    Input changed = input;
    changed[input.size() * i / 64] ^= static_cast<std::uint8_t>(0x81u >> (i % 8));
    run(changed);
  }
}

}  // namespace

int main(int argc, char** argv) {
  constexpr std::uintmax_t kMaxBytes = 1u << 20;
  std::size_t files = 0;
  const auto take = [&](const std::filesystem::path& path) {
    if (!std::filesystem::is_regular_file(path) || std::filesystem::file_size(path) > kMaxBytes) return;
    run_variants(bytes_of(path));
    ++files;
  };
  for (int i = 1; i < argc; ++i) {
    take(argv[i]);
    if (!std::filesystem::is_directory(argv[i])) continue;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(argv[i])) take(entry.path());
  }
  std::printf("%zu files, each in 81 variants\n", files);
  return files > 0 ? 0 : 1;
}
