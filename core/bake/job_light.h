#pragma once
// The distant light a recipe asks for, found and read.

#include <optional>

#include "core/bake/bake.h"
#include "core/base/result.h"
#include "core/scene/environment.h"

namespace kiln {

/// Nothing when the recipe names no environment. Rotation and intensity are set on it.
Result<std::optional<Environment>> job_light(const BakeInput&);

}  // namespace kiln
