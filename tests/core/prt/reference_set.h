#pragma once
// The reference values at vertices of shared/models/references, joined to imported scenes.

#include <optional>
#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace kiln::testing {

struct ReferenceSet {
  Scene scene;
  std::vector<std::uint32_t> element;  // the POSITION element of each value that is compared
  std::vector<std::uint32_t> vertex;   // its vertex in the imported scene
  std::string folder;

  /// NAME.f32 at the compared elements.
  std::vector<Vec3f> values(const std::string& name) const;
};

/// Empty when the folder is not there.
std::optional<ReferenceSet> load_reference_set(const std::string& shared, const std::string& scene);

/// A scene of shared/models by its path below it; empty when it is not there or is refused.
std::optional<Scene> load_scene(const std::string& shared, const std::string& path);

struct RelativeError {
  double all = 0, without_worst = 0;  // relRMSE over points and channels; the latter without the worst 1 % of points
};
RelativeError relative_error(const std::vector<Vec3f>& values, const std::vector<Vec3f>& reference);

}  // namespace kiln::testing
