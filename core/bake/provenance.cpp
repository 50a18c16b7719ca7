#include "core/bake/provenance.h"

#include <nlohmann/json.hpp>
#include <span>

#include "core/base/sha256.h"

namespace kiln {

std::string provenance(const BakeInput& input) {
  if (!input.made_of.empty()) return input.made_of;
  const std::string identity = recipe_identity(input.recipe);
  const auto bytes = std::span(reinterpret_cast<const std::uint8_t*>(identity.data()), identity.size());
  const nlohmann::ordered_json json = {{"engine", std::string("kiln ") + kEngineVersion},
                                       {"scene_sha256", sha256_hex(input.scene.main)},
                                       {"recipe_sha256", sha256_hex(bytes)},
                                       {"seed", input.recipe.seed}};
  return json.dump();
}

}  // namespace kiln
