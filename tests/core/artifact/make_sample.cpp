// kiln-make-sample OUT.glb [ORDER [CHANNELS]]             a sphere over a plane as a baked scene
// kiln-make-sample --everything OUT.glb [ORDER [CHANNELS]]  all that the format can carry

#include <cstdio>
#include <fstream>
#include <span>
#include <string>

#include "tests/core/artifact/sample_scene.h"

namespace {

int number_or(std::span<char*> arguments, std::size_t at, int absent) {
  return at < arguments.size() ? std::stoi(arguments[at]) : absent;
}

int write_sample(const char* path, const kiln::BakedScene& scene) {
  const auto file = kiln::write_baked_glb(scene);
  if (!file) {
    std::fprintf(stderr, "%s\n", file.error().message.c_str());
    return 65;
  }
  std::ofstream out(path, std::ios::binary);
  out.write(reinterpret_cast<const char*>(file->data()), static_cast<std::streamsize>(file->size()));
  return out.good() ? 0 : 73;
}

}  // namespace

int main(int argc, char** argv) {
  std::span<char*> arguments(argv + 1, static_cast<std::size_t>(argc - 1));
  const bool everything = !arguments.empty() && std::string(arguments[0]) == "--everything";
  if (everything) arguments = arguments.subspan(1);
  if (arguments.empty()) {
    std::fputs("usage: kiln-make-sample [--everything] OUT.glb [ORDER [CHANNELS]]\n", stderr);
    return 64;
  }
  const int order = number_or(arguments, 1, 4), channels = number_or(arguments, 2, 3);
  return write_sample(arguments[0],
                      everything ? kiln::everything(order, channels) : kiln::sphere_over_plane(order, channels, true));
}
