// kiln presets: the named recipes of this program.
#include <nlohmann/json.hpp>

#include "client_cli/commands.h"
#include "client_cli/files.h"
#include "core/bake/recipe.h"

namespace kiln {
namespace {

std::string presets_json() {
  nlohmann::json list = nlohmann::json::array();
  for (const Preset& preset : presets()) {
    list.push_back(
        {{"name", preset.name}, {"description", preset.description}, {"recipe", nlohmann::json::parse(preset.recipe)}});
  }
  return nlohmann::json{{"presets", list}}.dump() + "\n";
}

std::string presets_text() {
  std::string out;
  for (const Preset& preset : presets()) {
    out += preset.name + std::string(preset.name.size() < 14 ? 14 - preset.name.size() : 1, ' ') + preset.description +
           "\n";
  }
  return out;
}

}  // namespace

Outcome<ExitCode> run(const PresetsOptions&, Session& session) {
  const Outcome<void> written = write_text("", session.common.json ? presets_json() : presets_text());
  if (!written) return tl::make_unexpected(written.error());
  return ExitCode::ok;
}

}  // namespace kiln
