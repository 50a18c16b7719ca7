#include "core/bake/job_light.h"

extern "C" const std::uint8_t kiln_courtyard_begin[];
extern "C" const std::uint8_t kiln_courtyard_end[];

namespace kiln {
namespace {

Result<Environment> named_light(const BakeInput& input) {
  using Kind = EnvironmentChoice::Kind;
  const EnvironmentChoice& choice = input.recipe.environment;
  if (choice.kind == Kind::constant) return constant_sky(choice.constant);
  if (choice.kind == Kind::builtin && choice.name == "overcast") return overcast_sky();
  if (choice.kind == Kind::builtin && choice.name == "clear") return clear_sky_with_sun();
  if (choice.kind == Kind::builtin && choice.name == "courtyard") {
    return import_environment({kiln_courtyard_begin, kiln_courtyard_end}, "courtyard.exr");
  }
  if (choice.kind == Kind::builtin) return constant_sky({1, 1, 1});
  if (input.environment.empty()) return fault("environment_missing", "the environment's file is empty or was not sent");
  return import_environment(input.environment, input.environment_name);
}

std::string light_name(const BakeInput& input) {
  using Kind = EnvironmentChoice::Kind;
  const EnvironmentChoice& choice = input.recipe.environment;
  if (choice.kind == Kind::constant) return "constant";
  if (choice.kind == Kind::builtin) return choice.name;
  return input.environment_name.empty() ? "environment" : input.environment_name;
}

}  // namespace

Result<std::optional<Environment>> job_light(const BakeInput& input) {
  const EnvironmentChoice& choice = input.recipe.environment;
  if (choice.kind == EnvironmentChoice::Kind::none) return std::optional<Environment>();
  KILN_TRY(light, named_light(input));
  light.name = light_name(input);
  light.rotation_deg = choice.rotation_deg;
  light.intensity = choice.intensity;
  return std::optional<Environment>(std::move(light));
}

}  // namespace kiln
