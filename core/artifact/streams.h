#pragma once
// Where the bytes of a scene.glb go.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/artifact/baked_scene.h"

namespace kiln {

struct StreamBytes {
  std::string name;
  std::uint64_t bytes = 0;
};

/// Bytes of each stream of `file`, which write_baked_glb made of the same scene and encoding. They add up to its size.
/// Measured: every part is encoded again with connectivity and positions alone, then with one more stream at a time; a
/// stream's bytes are the growth it causes. The coefficients are what is left of the compressed parts (with up to 3
/// bytes of padding for each part and image). Cost    a few encodings without the coefficients, a fraction of the
/// writing itself. Fails   as write_baked_glb does.
Result<std::vector<StreamBytes>> stream_bytes(const BakedScene&, const Encoding&, std::span<const std::uint8_t> file);

}  // namespace kiln
