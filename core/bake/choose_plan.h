#pragma once
// The plan of a recipe's step, whichever it is.

#include <optional>

#include "core/artifact/carried_scene.h"
#include "core/bake/plan.h"
#include "core/bake/recipe.h"
#include "core/base/result.h"
#include "core/base/threads.h"
#include "core/scene/environment.h"

namespace kiln {

/// Faults are those of the layout of a lightmap.
Result<Plan> plan_of(const CarriedScene&, const Recipe&, const std::optional<Environment>& light, Threads&);

}  // namespace kiln
