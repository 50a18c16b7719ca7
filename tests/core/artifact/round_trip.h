#pragma once
// Writing and reading in one step, for tests.

#include <stdexcept>

#include "core/artifact/baked_scene.h"

namespace kiln {

inline BakedScene round_trip(const BakedScene& baked, const Encoding& encoding = {}) {
  const auto file = write_baked_glb(baked, encoding);
  if (!file) throw std::runtime_error("not written: " + file.error().message);
  auto read = read_baked_glb(*file);
  if (!read) throw std::runtime_error("not read: " + read.error().where + " " + read.error().message);
  return std::move(*read);
}

}  // namespace kiln
