#pragma once
// The model files that all of the team share, where they are present.

#include <filesystem>
#include <string>

#include "core/artifact/import.h"

namespace kiln::test {

inline std::filesystem::path shared_models() { return std::filesystem::path(KILN_SHARED) / "models"; }

inline Result<Scene> import_shared(const std::string& path) {
  const auto files = read_scene_files((shared_models() / path).string());
  if (!files) return tl::make_unexpected(files.error());
  return import_scene(*files);
}

}  // namespace kiln::test
