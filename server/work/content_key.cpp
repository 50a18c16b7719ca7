#include "server/work/content_key.h"

#include <algorithm>

#include "core/bake/bake.h"
#include "core/base/sha256.h"

namespace kiln {
namespace {

/// Length first, so that no two lists of texts run into the same bytes.
void add(std::string& bytes, const std::string& text) { bytes += std::to_string(text.size()) + ":" + text; }

}  // namespace

std::string content_key(const std::string& tenant, const JobInputs& inputs, const Recipe& recipe) {
  std::vector<NamedBlob> resources = inputs.resources;
  std::ranges::sort(resources, {}, &NamedBlob::name);

  std::string bytes;
  if (!tenant.empty()) add(bytes, "tenant " + tenant);
  add(bytes, kEngineVersion);
  add(bytes, inputs.scene.sha256);
  add(bytes, inputs.environment ? inputs.environment->sha256 : "");
  add(bytes, recipe_identity(recipe));
  for (const NamedBlob& resource : resources) {
    add(bytes, resource.name);
    add(bytes, resource.sha256);
  }
  return sha256_hex({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
}

}  // namespace kiln
