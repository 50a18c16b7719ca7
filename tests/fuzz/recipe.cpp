// A job document as the door takes it. What is accepted says the same when it is written and read again.

#include "server/api/job_request.h"
#include "tests/fuzz/target.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kiln;
  const std::string_view json = fuzz::text_of(data, size);
  const auto checked = check_json(json);
  if (!checked) {
    fuzz::promise(checked.error().status >= 400);
    return 0;
  }
  (void)parse_job_request(json);
  const auto recipe = parse_recipe(json);
  if (!recipe) {
    fuzz::promise(!recipe.error().empty());
    return 0;
  }
  const auto again = parse_recipe(recipe_json(*recipe));
  fuzz::promise(again.has_value() && recipe_json(*again) == recipe_json(*recipe));
  fuzz::promise(recipe_identity(*again) == recipe_identity(*recipe));
  return 0;
}
