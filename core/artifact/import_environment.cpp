#include <cmath>

#include "core/artifact/exr_reader.h"
#include "core/artifact/hdr_reader.h"
#include "core/artifact/import.h"

namespace kiln {
namespace {

/// Light is finite and not negative; anything else names its pixel.
Result<Environment> checked(Environment e) {
  for (std::size_t i = 0; i < e.radiance.size(); ++i) {
    Vec3f& c = e.radiance[i];
    const std::size_t x = i % static_cast<std::size_t>(e.width), y = i / static_cast<std::size_t>(e.width);
    if (!is_finite(c)) {
      return fault("non_finite_radiance", "A pixel is not a finite number.",
                   e.name + ": pixel " + std::to_string(x) + ", " + std::to_string(y));
    }
    c = {std::fmax(c.x, 0.0F), std::fmax(c.y, 0.0F), std::fmax(c.z, 0.0F)};
  }
  return e;
}

}  // namespace

Result<Environment> import_environment(std::span<const std::uint8_t> file, const std::string& name) {
  try {
    if (looks_like_hdr(file)) return read_hdr(file, name).and_then(checked);
    if (looks_like_exr(file)) return read_exr(file, name).and_then(checked);
    return fault("unknown_format", "The file is neither Radiance .hdr nor OpenEXR.", name);
  } catch (const std::bad_alloc&) {
    return fault("out_of_memory", "The picture does not fit into the memory of this process.", name);
  }
}

}  // namespace kiln
