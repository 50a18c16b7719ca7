#pragma once
// Which engine made an artefact, of what.

#include <string>

#include "core/bake/bake.h"

namespace kiln {

/// A JSON object for asset.extras.kiln: engine, hashes of scene and recipe, seed; input.made_of where that is given.
std::string provenance(const BakeInput&);

}  // namespace kiln
