#include "core/bake/recipe.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace kiln {
namespace {

std::vector<std::string> pointers(const std::string& json) {
  const auto recipe = parse_recipe(json);
  std::vector<std::string> out;
  if (!recipe) {
    for (const FieldError& e : recipe.error()) out.push_back(e.pointer);
  }
  std::sort(out.begin(), out.end());
  return out;
}

TEST(Recipe, EmptyObjectIsOnePrtStepWithEverythingLeftToThePlan) {
  const auto recipe = parse_recipe("{}");
  ASSERT_TRUE(recipe);
  ASSERT_EQ(recipe->steps.size(), 1U);
  EXPECT_FALSE(recipe->steps[0].order);
  EXPECT_EQ(recipe->quality, Quality::standard);
  EXPECT_EQ(recipe->environment.kind, EnvironmentChoice::Kind::none);
}

TEST(Recipe, AllMistakesAreReportedTogetherWithTheirPointers) {
  const std::vector<std::string> expected = {
      "/environment/constant", "/limits/threads", "/steps/0/order", "/steps/0/subdivide/measure",
      "/steps/0/typo",         "/strict",         "/surprise"};
  EXPECT_EQ(pointers(R"({"steps":[{"do":"prt","order":11,"typo":1,"subdivide":{"measure":"eq5"}}],
                         "environment":{"constant":[1,2]},"limits":{"threads":-1},"strict":"yes","surprise":null})"),
            expected);
}

TEST(Recipe, AnErrorSaysWhatStoodThereAndWhatMay) {
  const auto recipe = parse_recipe(R"({"steps":[{"do":"prt","order":0}]})");
  ASSERT_FALSE(recipe);
  ASSERT_EQ(recipe.error().size(), 1U);
  EXPECT_EQ(recipe.error()[0].received, "0");
  EXPECT_EQ(recipe.error()[0].allowed, "an integer from 1 to 10");
}

TEST(Recipe, NumbersOutsideTheirTypeAreRefusedNotRounded) {
  EXPECT_EQ(pointers(R"({"seed":1.5})"), std::vector<std::string>{"/seed"});
  EXPECT_EQ(pointers(R"({"seed":18446744073709551615})"), std::vector<std::string>{"/seed"});
  EXPECT_EQ(pointers(R"({"seed":-1})"), std::vector<std::string>{"/seed"});
  EXPECT_EQ(pointers(R"({"environment":{"builtin":"clear","intensity":1e300}})"),
            std::vector<std::string>{"/environment/intensity"});
}

TEST(Recipe, APromiseThatContradictsOtherKnobsIsRefused) {
  EXPECT_EQ(pointers(R"({"quality":{"target_error":0.1},"certificate":false})"),
            std::vector<std::string>{"/certificate"});
  EXPECT_EQ(pointers(R"({"quality":{"time_budget_s":100},"limits":{"wall_s":50}})"),
            std::vector<std::string>{"/quality/time_budget_s"});
  EXPECT_EQ(pointers(R"({"quality":{"target_error":0.1},"steps":[{"do":"prt","samples":64,"subdivide":"off"}]})"),
            std::vector<std::string>{"/quality"});
}

TEST(Recipe, TwoLightsAtOnceAreRefused) {
  EXPECT_EQ(pointers(R"({"environment":{"builtin":"clear","constant":[1,1,1]}})"),
            std::vector<std::string>{"/environment"});
}

TEST(Recipe, WhatIsNotJsonOrTooDeepIsOneErrorAndNoCrash) {
  EXPECT_EQ(pointers("{").size(), 1U);
  EXPECT_EQ(pointers("[]").size(), 1U);
  EXPECT_EQ(pointers(std::string(100'000, '[')).size(), 1U);
  EXPECT_EQ(pointers(std::string("{\"label\":\"\xff\"}")).size(), 1U);
}

TEST(Recipe, CanonicalTextIsAFixedPoint) {
  for (const Preset& preset : presets()) {
    const auto recipe = parse_recipe(preset.recipe);
    ASSERT_TRUE(recipe) << preset.name;
    const auto again = parse_recipe(recipe_json(*recipe));
    ASSERT_TRUE(again) << preset.name;
    EXPECT_EQ(recipe_json(*again), recipe_json(*recipe)) << preset.name;
  }
}

TEST(Recipe, IdentityIgnoresWhatLeavesTheBytesAlone) {
  const auto a = parse_recipe(R"({"label":"x","limits":{"threads":1}})");
  const auto b = parse_recipe(R"({"label":"y","limits":{"threads":2}})");
  const auto c = parse_recipe(R"({"seed":7})");
  ASSERT_TRUE(a && b && c);
  EXPECT_EQ(recipe_identity(*a), recipe_identity(*b));
  EXPECT_NE(recipe_identity(*a), recipe_identity(*c));
}

TEST(Recipe, OfRadiosityHasItsOwnParametersAndSurvivesARoundTrip) {
  const auto recipe = parse_recipe(
      R"({"steps":[{"do":"radiosity","points":{"radius":0.25,"levels":4},"rays":64,"subdivide":{"triangles":900}}]})");
  ASSERT_TRUE(recipe);
  EXPECT_TRUE(recipe->steps.empty());
  ASSERT_TRUE(recipe->radiosity);
  EXPECT_EQ(recipe->radiosity->radius, 0.25);
  EXPECT_EQ(recipe->radiosity->levels, 4);
  EXPECT_EQ(recipe->radiosity->rays, 64);
  EXPECT_FALSE(recipe->radiosity->bounces);
  const auto again = parse_recipe(recipe_json(*recipe));
  ASSERT_TRUE(again);
  EXPECT_EQ(recipe_json(*again), recipe_json(*recipe));
}

TEST(Recipe, OfRadiositySaysWhereTheLightGoes) {
  const auto plain = parse_recipe(R"({"steps":[{"do":"radiosity"}]})");
  const auto named = parse_recipe(R"({"steps":[{"do":"radiosity","deliver":["vertices"]}]})");
  ASSERT_TRUE(plain && named);
  EXPECT_EQ(recipe_json(*plain), recipe_json(*named));
  EXPECT_EQ(recipe_json(*plain).find("deliver"), std::string::npos);  // hashes of older recipes stay what they were
  const auto map =
      parse_recipe(R"({"steps":[{"do":"radiosity","deliver":["points","lightmap"],"lightmap":{"size":512}}]})");
  ASSERT_TRUE(map);
  EXPECT_FALSE(map->radiosity->deliver.vertices);
  EXPECT_TRUE(map->radiosity->deliver.lightmap && map->radiosity->deliver.points);
  EXPECT_EQ(map->radiosity->lightmap_size, 512);
  const auto again = parse_recipe(recipe_json(*map));
  ASSERT_TRUE(again);
  EXPECT_EQ(recipe_json(*again), recipe_json(*map));
  EXPECT_NE(recipe_identity(*map), recipe_identity(*plain));
  EXPECT_EQ(pointers(R"({"steps":[{"do":"radiosity","deliver":["lightmap","maps"],"lightmap":{"size":4}}]})"),
            (std::vector<std::string>{"/steps/0/deliver", "/steps/0/lightmap/size"}));
  EXPECT_EQ(pointers(R"({"steps":[{"do":"radiosity","lightmap":{"size":64}}]})"),
            std::vector<std::string>{"/steps/0/lightmap"});
}

TEST(Recipe, APromiseOfALightFieldNeedsSomethingToSpend) {
  EXPECT_TRUE(parse_recipe(R"({"quality":{"target_error":0.1},"steps":[{"do":"lightfield","degree":4,"rays":64}]})"));
  const std::string fixed = R"("steps":[{"do":"lightfield","degree":4,"rays":64,"subdivide":"off")";
  EXPECT_TRUE(parse_recipe(R"({"quality":{"target_error":0.1},)" + fixed + "}]}"));  // simplification is left
  EXPECT_EQ(pointers(R"({"quality":{"time_budget_s":9},)" + fixed + "}]}"), std::vector<std::string>{"/quality"});
  EXPECT_EQ(pointers(R"({"quality":{"target_error":0.1},)" + fixed + R"(,"simplify":"off"}]})"),
            std::vector<std::string>{"/quality"});
  EXPECT_EQ(pointers(R"({"quality":{"target_error":0.1},"steps":[{"do":"reduce"},
                         {"do":"lightfield","simplify":{"max_error":0.2}}]})"),
            std::vector<std::string>{"/steps/1/simplify/max_error"});
}

TEST(Recipe, APromiseOfRadiosityNeedsSomethingToSpend) {
  EXPECT_TRUE(parse_recipe(R"({"quality":{"target_error":0.1},"steps":[{"do":"radiosity","rays":64}]})"));
  EXPECT_EQ(pointers(R"({"quality":{"target_error":0.1},"steps":[{"do":"radiosity","deliver":["lightmap"]}]})"),
            std::vector<std::string>{"/quality"});
  EXPECT_EQ(pointers(R"({"quality":{"target_error":0.1},
                         "steps":[{"do":"radiosity","rays":64,"points":{"radius":0.1},"subdivide":"off"}]})"),
            (std::vector<std::string>{"/quality"}));
}

TEST(Recipe, OfAGridHasItsOwnParametersAndSurvivesARoundTrip) {
  const auto recipe = parse_recipe(
      R"({"steps":[{"do":"grid","resolution":[4,5,6],"content":"all","blend":"paper","bounces":3,"samples":99}]})");
  ASSERT_TRUE(recipe);
  EXPECT_TRUE(recipe->steps.empty());
  EXPECT_FALSE(recipe->radiosity);
  ASSERT_TRUE(recipe->grid);
  EXPECT_EQ(recipe->grid->resolution, (std::array<int, 3>{4, 5, 6}));
  EXPECT_EQ(recipe->grid->content, GridContent::all);
  EXPECT_EQ(recipe->grid->blend, GridBlend::paper);
  EXPECT_EQ(recipe->grid->bounces, 3);
  EXPECT_EQ(recipe->grid->samples, 99);
  const auto again = parse_recipe(recipe_json(*recipe));
  ASSERT_TRUE(again);
  EXPECT_EQ(recipe_json(*again), recipe_json(*recipe));
}

TEST(Recipe, OfAReductionHasItsOwnParametersAndSurvivesARoundTrip) {
  for (const char* text : {R"({"steps":[{"do":"reduce","triangles":5000,"method":"cluster","normal_map":256}]})",
                           R"({"steps":[{"do":"reduce","ratio":0.25,"normal_map":"off"}]})",
                           R"({"steps":[{"do":"reduce"}]})", R"({"steps":[{"do":"reduce","normal_bits":16}]})"}) {
    const auto recipe = parse_recipe(text);
    ASSERT_TRUE(recipe);
    EXPECT_TRUE(recipe->steps.empty());
    ASSERT_TRUE(recipe->reduce);
    const auto again = parse_recipe(recipe_json(*recipe));
    ASSERT_TRUE(again);
    EXPECT_EQ(recipe_json(*again), recipe_json(*recipe));
    EXPECT_EQ(again->reduce->triangles, recipe->reduce->triangles);
    EXPECT_EQ(again->reduce->ratio, recipe->reduce->ratio);
    EXPECT_EQ(again->reduce->method, recipe->reduce->method);
    EXPECT_EQ(again->reduce->normal_map, recipe->reduce->normal_map);
    EXPECT_EQ(again->reduce->normal_bits, recipe->reduce->normal_bits);
  }
  EXPECT_EQ(parse_recipe(R"({"steps":[{"do":"reduce","normal_map":"off"}]})")->reduce->normal_map, 0);
}

TEST(Recipe, OfAReductionMayGoOnWithLight) {
  const auto recipe = parse_recipe(
      R"({"quality":{"target_error":0.1},"steps":[{"do":"reduce","triangles":900},{"do":"prt","order":4}]})");
  ASSERT_TRUE(recipe);
  EXPECT_EQ(recipe->reduce->triangles, 900U);
  EXPECT_EQ(recipe->steps.at(0).order, 4);
  const auto again = parse_recipe(recipe_json(*recipe));
  ASSERT_TRUE(again);
  EXPECT_EQ(recipe_json(*again), recipe_json(*recipe));
  EXPECT_EQ(pointers(R"({"steps":[{"do":"prt"},{"do":"reduce"}]})"), (std::vector<std::string>{"/steps"}));
  EXPECT_EQ(pointers(R"({"steps":[{"do":"reduce"},{"do":"prt","order":77}]})"),
            (std::vector<std::string>{"/steps/1/order"}));
}

TEST(Recipe, OfAReductionNamesWhatIsWrong) {
  EXPECT_EQ(pointers(R"({"steps":[{"do":"reduce","triangles":9,"ratio":0.5}]})"),
            (std::vector<std::string>{"/steps/0/ratio"}));
  EXPECT_EQ(pointers(R"({"steps":[{"do":"reduce","normal_map":"big"}]})"),
            (std::vector<std::string>{"/steps/0/normal_map"}));
  for (const char* step : {R"({"do":"reduce","normal_bits":12})", R"({"do":"reduce","normal_bits":"16"})",
                           R"({"do":"reduce","normal_map":"off","normal_bits":16})"})
    EXPECT_EQ(pointers(std::string(R"({"steps":[)") + step + "]}"), (std::vector<std::string>{"/steps/0/normal_bits"}));
  EXPECT_EQ(pointers(R"({"quality":{"target_error":0.1},"steps":[{"do":"reduce"}]})"),
            (std::vector<std::string>{"/quality"}));
}

TEST(Recipe, OfASimplificationNamesTargetsThatAreNone) {
  const auto simplify = [](const std::string& target) {
    return pointers(R"({"steps":[{"do":"lightfield","simplify":)" + target + "}]}");
  };
  const std::vector<std::string> ratio{"/steps/0/simplify/ratio"}, triangles{"/steps/0/simplify/triangles"};
  for (const char* wrong : {"0", "-0.5", "1.5", "1e300", R"("half")", "null"})
    EXPECT_EQ(simplify(R"({"ratio":)" + std::string(wrong) + "}"), ratio) << wrong;
  for (const char* wrong : {"0", "3", "-9", "10.5", "1e300"})
    EXPECT_EQ(simplify(R"({"triangles":)" + std::string(wrong) + "}"), triangles) << wrong;
  EXPECT_EQ(simplify(R"({"max_error":1.5})"), (std::vector<std::string>{"/steps/0/simplify/max_error"}));
  EXPECT_EQ(simplify(R"({"triangles":9,"ratio":0.5})"), ratio);
  EXPECT_EQ(simplify(R"({"ratio":1})"), std::vector<std::string>{});
}

TEST(Recipe, PromisesOfAGridNeedAResolutionLeftOpen) {
  EXPECT_TRUE(parse_recipe(R"({"quality":{"target_error":0.1},"steps":[{"do":"grid"}]})"));
  EXPECT_EQ(pointers(R"({"quality":{"target_error":0.1},"steps":[{"do":"grid","resolution":[4,4,4]}]})"),
            (std::vector<std::string>{"/quality"}));
}

}  // namespace
}  // namespace kiln
