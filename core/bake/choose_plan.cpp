#include "core/bake/choose_plan.h"

#include "core/bake/carried_light.h"
#include "core/bake/glossy_plan.h"
#include "core/bake/grid_step.h"
#include "core/bake/light_field_step.h"
#include "core/bake/lightmap_step.h"
#include "core/bake/links_step.h"
#include "core/bake/radiosity_step.h"

namespace kiln {
namespace {

Effort effort_of(const Recipe& recipe) {
  return recipe.promise ? first_effort(recipe.promise) : effort_of(recipe.quality);
}

Result<Plan> plan_of_step(const CarriedScene& in, const Recipe& recipe, const Environment* sky, Threads& threads) {
  const Scene& scene = in.scene;
  if (in.carries_light()) return make_carried_plan(in, recipe, sky != nullptr);
  if (recipe.grid) return make_grid_plan(scene, recipe, sky, threads);
  if (recipe.transport) return make_links_plan(scene, recipe, sky, threads);
  if (recipe.light_field) return make_light_field_plan(scene, recipe, sky, threads);
  if (recipe.radiosity) {
    const RadiosityEffort effort = recipe.promise ? radiosity_effort(recipe.promise) : radiosity_effort(recipe.quality);
    Plan plan = make_radiosity_plan(scene, *recipe.radiosity, effort, sky, threads);
    if (!recipe.radiosity->deliver.lightmap) return plan;
    const Result<void> done = plan_lightmap(scene, recipe, plan);
    return done ? Result<Plan>(std::move(plan)) : tl::make_unexpected(done.error());
  }
  return make_plan(scene, recipe.steps.front(), effort_of(recipe), threads);
}

}  // namespace

Result<Plan> plan_of(const CarriedScene& in, const Recipe& recipe, const std::optional<Environment>& light,
                     Threads& threads) {
  KILN_TRY(plan, plan_of_step(in, recipe, light ? &*light : nullptr, threads));
  const bool diffuse = recipe.radiosity || recipe.grid || recipe.transport;
  if (const auto warning = diffuse ? shown_as_matte(in.scene) : std::nullopt) plan.warnings.push_back(*warning);
  return plan;
}

}  // namespace kiln
