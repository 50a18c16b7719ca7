// kiln-make-sample OUT.glb [ORDER [CHANNELS]]: writes the sphere-over-plane sample as a baked scene.

#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "tests/core/artifact/sample_scene.h"

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fputs("usage: kiln-make-sample OUT.glb [ORDER [CHANNELS]]\n", stderr);
    return 64;
  }
  const int order = argc > 2 ? std::atoi(argv[2]) : 4, channels = argc > 3 ? std::atoi(argv[3]) : 3;
  const auto file = kiln::write_baked_glb(kiln::sphere_over_plane(order, channels, true));
  if (!file) {
    std::fprintf(stderr, "%s\n", file.error().message.c_str());
    return 65;
  }
  std::ofstream out(argv[1], std::ios::binary);
  out.write(reinterpret_cast<const char*>(file->data()), static_cast<std::streamsize>(file->size()));
  return out.good() ? 0 : 73;
}
