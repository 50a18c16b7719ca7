#pragma once
// The recipe of a command: file or preset, changed by options, its environment file read and named by its hash.

#include <optional>
#include <string>

#include "client_cli/failure.h"
#include "client_cli/options.h"
#include "core/artifact/import.h"
#include "core/bake/recipe.h"
#include "core/scene/environment.h"

namespace kiln {

/// A recipe as it goes to the server: an environment file has become an asset, so that a bake here and a bake there
/// have the same recipe and give the same bytes.
struct LoadedRecipe {
  std::string document;  // JSON; not yet checked
  Bytes environment;     // of the environment file; empty: none
  std::string environment_name;
};

/// A path in a recipe file is relative to that file. Neither file nor preset: preset "prt".
/// An unknown preset is left to a server (`remote`) and is a failure here.
Outcome<LoadedRecipe> load_recipe(const RecipeOptions&, bool remote);

/// The checked recipe of a local bake.
Outcome<Recipe> checked_recipe(const LoadedRecipe&);

/// The light of --env; nothing when it was not given.
Outcome<std::optional<Environment>> load_light(const LightOptions&);

}  // namespace kiln
