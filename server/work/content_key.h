#pragma once
// What a result depends on, as one hash. Equal keys give equal artefacts.

#include <string>

#include "core/bake/recipe.h"
#include "server/jobs/job.h"

namespace kiln {

/// SHA-256 over the tenant (one tenant's results never answer another's job), engine version, contents of all inputs
/// (resources with their URIs) and what of the recipe decides the result (recipe_identity: no label, no limits).
std::string content_key(const std::string& tenant, const JobInputs&, const Recipe&);

}  // namespace kiln
