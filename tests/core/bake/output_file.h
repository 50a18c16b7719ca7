#pragma once
// A file of what a bake gives, by its name.

#include <algorithm>
#include <string>

#include "core/bake/bake.h"

namespace kiln::testing {

inline const Bytes& file(const BakeOutput& output, const std::string& name) {
  return std::ranges::find(output.files, name, &ArtifactFile::name)->bytes;
}

}  // namespace kiln::testing
