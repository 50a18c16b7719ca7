#include "client_cli/recipe_input.h"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "client_cli/csv.h"
#include "client_cli/files.h"
#include "core/bake/bake.h"
#include "core/bake/job_light.h"
#include "core/base/sha256.h"

namespace kiln {
namespace {

using nlohmann::json;

constexpr const char* kDefaultPreset = "prt";
constexpr const char* kBuiltin = "builtin:";

bool is_hash(const std::string& text) {
  return text.size() == 64 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

/// Three numbers with commas between them.
std::optional<json> constant_of(const std::string& text) {
  const auto table = parse_csv(text, "", {"r", "g", "b"});
  if (!table || table->rows.size() != 1 || table->columns.size() != 3) return std::nullopt;
  return json(table->rows[0]);
}

/// The environment object that the name of a light stands for.
Outcome<json> named_environment(const std::string& name) {
  if (file_exists(name)) return json{{"file", name}};
  if (const auto constant = constant_of(name)) return json{{"constant", *constant}};
  if (name.rfind(kBuiltin, 0) == 0) return json{{"builtin", name.substr(std::string(kBuiltin).size())}};
  if (is_hash(name)) return json{{"asset", name}};
  return fail(ExitCode::not_found, "not_found", "is no light: give a .hdr or .exr file, r,g,b, or builtin:NAME", name);
}

/// Puts the light of the command line into a document.
Outcome<void> apply_light(const LightOptions& light, json& document) {
  if (!light.name.empty()) {
    KILN_TRY(environment, named_environment(light.name));
    document["environment"] = std::move(environment);
  }
  if (!light.rotation_deg && !light.intensity) return {};
  if (!document.contains("environment") || !document["environment"].is_object())
    return fail(ExitCode::usage, "no_environment", "--rotation and --intensity need an environment to act on");
  if (light.rotation_deg) document["environment"]["rotation_deg"] = *light.rotation_deg;
  if (light.intensity) document["environment"]["intensity"] = *light.intensity;
  return {};
}

Outcome<json> recipe_of_file(const std::string& path) {
  KILN_TRY(text, read_text(path));
  try {
    json document = json::parse(text);
    if (!document.is_object()) return fail(ExitCode::rejected, "invalid_recipe", "is not a JSON object", path);
    if (document.contains("environment") && document["environment"].is_object()) {
      json& environment = document["environment"];
      if (environment.contains("file") && environment["file"].is_string()) {
        const auto folder = std::filesystem::path(path).parent_path();
        environment["file"] = (folder / environment["file"].get<std::string>()).string();
      }
    }
    return document;
  } catch (const json::parse_error& error) {
    return fail(ExitCode::rejected, "malformed_json", "is not JSON from byte " + std::to_string(error.byte) + " on",
                path);
  }
}

Outcome<json> recipe_of_preset(const std::string& name, bool remote) {
  for (const Preset& preset : presets()) {
    if (preset.name == name) return json::parse(preset.recipe);
  }
  if (remote) return json{{"preset", name}};
  std::string known;
  for (const Preset& preset : presets()) known += (known.empty() ? "" : ", ") + preset.name;
  return fail(ExitCode::rejected, "unknown_preset", "there is no such preset; there are " + known, name);
}

void apply_words(const RecipeOptions& options, json& document) {
  if (!options.label.empty()) document["label"] = options.label;
  if (!options.quality.empty()) document["quality"] = options.quality;
  if (options.target_error || options.time_budget_s) document["quality"] = json::object();
  if (options.target_error) document["quality"]["target_error"] = *options.target_error;
  if (options.time_budget_s) document["quality"]["time_budget_s"] = *options.time_budget_s;
  if (options.seed) document["seed"] = *options.seed;
  if (options.threads) document["limits"]["threads"] = *options.threads;
  if (options.force) document["force"] = true;
}

/// A missing file does not hide what else is wrong with a recipe.
Failure with_other_mistakes(const json& document, Failure missing) {
  json checked = document;
  checked.erase("force");
  auto recipe = parse_recipe(checked.dump(-1, ' ', false, json::error_handler_t::replace));
  if (recipe) return missing;
  std::vector<FieldError> all = std::move(recipe.error());
  all.push_back({"/environment/file", missing.problem.detail, document["environment"]["file"].dump(), ""});
  return failure_of(std::move(all));
}

/// Reads the environment file, if there is one, and puts its hash in its place.
Outcome<LoadedRecipe> with_environment(json document) {
  LoadedRecipe loaded;
  json* environment = document.contains("environment") ? &document["environment"] : nullptr;
  if (environment && environment->is_object() && environment->contains("file") && (*environment)["file"].is_string()) {
    const auto path = (*environment)["file"].get<std::string>();
    Outcome<Bytes> bytes = read_file(path);
    if (!bytes) return tl::make_unexpected(with_other_mistakes(document, std::move(bytes.error())));
    loaded.environment = std::move(*bytes);
    loaded.environment_name = base_name(path);
    environment->erase("file");
    (*environment)["asset"] = sha256_hex(loaded.environment);
  }
  loaded.document = document.dump(-1, ' ', false, json::error_handler_t::replace);
  return loaded;
}

}  // namespace

Outcome<LoadedRecipe> load_recipe(const RecipeOptions& options, bool remote) {
  const std::string preset = options.preset.empty() ? kDefaultPreset : options.preset;
  KILN_TRY(document, options.file.empty() ? recipe_of_preset(preset, remote) : recipe_of_file(options.file));
  const Outcome<void> lit = apply_light(options.light, document);
  if (!lit) return tl::make_unexpected(lit.error());
  apply_words(options, document);
  return with_environment(std::move(document));
}

Outcome<Recipe> checked_recipe(const LoadedRecipe& loaded) {
  json document = json::parse(loaded.document);
  document.erase("force");  // a local bake has no cache to pass by
  auto recipe = parse_recipe(document.dump());
  if (!recipe) return tl::make_unexpected(failure_of(std::move(recipe.error())));
  if (recipe->environment.kind == EnvironmentChoice::Kind::asset && loaded.environment.empty())
    return fail(ExitCode::rejected, "asset_not_found", "an asset can only be named to a server; give a file here");
  return std::move(*recipe);
}

Outcome<std::optional<Environment>> load_light(const LightOptions& options) {
  json document = json::object();
  const Outcome<void> lit = apply_light(options, document);
  if (!lit) return tl::make_unexpected(lit.error());
  KILN_TRY(loaded, with_environment(std::move(document)));
  KILN_TRY(recipe, checked_recipe(loaded));
  BakeInput input;
  input.recipe = std::move(recipe);
  input.environment = std::move(loaded.environment);
  input.environment_name = loaded.environment_name;
  return or_failure(job_light(input));
}

}  // namespace kiln
