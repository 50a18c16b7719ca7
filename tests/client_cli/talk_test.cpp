#include <gtest/gtest.h>

#include "client_cli/progress_bar.h"
#include "client_cli/recipe_input.h"
#include "client_cli/report_text.h"
#include "client_cli/terminal.h"
#include "tests/client_cli/run_kiln.h"

namespace kiln {
namespace {

TEST(Talk, QuantitiesReadWell) {
  EXPECT_EQ(human_bytes(0), "0 B");
  EXPECT_EQ(human_bytes(999), "999 B");
  EXPECT_EQ(human_bytes(1234567), "1.2 MB");
  EXPECT_EQ(human_bytes(123456789), "123 MB");
  EXPECT_EQ(human_seconds(3.21), "3.2 s");
  EXPECT_EQ(human_seconds(75), "1 min 15 s");
  EXPECT_EQ(human_seconds(7260), "2 h 1 min");
}

TEST(Talk, AReducedModelThatIsFarOffIsSaidAndNeedsMoreTriangles) {
  const auto text = [](const std::string& rms) {
    return certificate_text(R"({"certificate":null,"reduce":{"unchanged":false,"error":{"rms":)" + rms +
                            R"(,"max":0.5}}})");
  };
  EXPECT_NE(text("0.285").find("28.5 %"), std::string::npos);
  EXPECT_NE(text("0.285").find("more triangles"), std::string::npos);
  EXPECT_NE(text("0.0006").find("0.06 %"), std::string::npos);
  EXPECT_EQ(text("0.0006").find("more triangles"), std::string::npos);
  EXPECT_EQ(certificate_text(R"({"certificate":null,"reduce":{"unchanged":true,"error":{"rms":0,"max":0}}})"), "");
}

TEST(Talk, LightTooSharpForTheBandsIsSaid) {
  const auto text = [](const std::string& transport, const std::string& full) {
    return certificate_text(R"({"certificate":{"relrmse":)" + transport + R"(,"job_light":{"relrmse":)" + full + "}}}");
  };
  EXPECT_NE(text("0.05", "2.64").find("bands are too few"), std::string::npos);
  EXPECT_EQ(text("0.05", "0.12").find("bands are too few"), std::string::npos);
  EXPECT_EQ(text("0.6", "0.7").find("bands are too few"), std::string::npos) << "there it is the bake that is off";
}

TEST(Talk, AProgressLineNamesStagePercentTimeAndError) {
  ProgressReply progress;
  progress.stage = "transfer";
  progress.fraction = 0.256;
  EXPECT_EQ(progress_line(progress, 80), " 25 %  transfer");
  progress.eta_s = 12;
  progress.error = 0.031;
  EXPECT_EQ(progress_line(progress, 80), " 25 %  transfer  ETA 12 s  error 0.031");
  EXPECT_EQ(progress_line(progress, 10).size(), 10U);
}

TEST(RecipeInput, OptionsWinOverTheRecipesOwnFields) {
  const Folder folder;
  RecipeOptions options;
  options.file = folder.write("r.json", R"({"seed":1,"quality":"final","environment":{"builtin":"clear"}})");
  options.seed = 9;
  options.light = {"0.5,0.5,1", 90.0, std::nullopt};
  options.force = true;
  const auto loaded = load_recipe(options, false);
  ASSERT_TRUE(loaded);
  const auto recipe = checked_recipe(*loaded);
  ASSERT_TRUE(recipe);
  EXPECT_EQ(recipe->seed, 9U);
  EXPECT_EQ(recipe->environment.kind, EnvironmentChoice::Kind::constant);
  EXPECT_EQ(recipe->environment.constant, (Vec3f{0.5F, 0.5F, 1}));
  EXPECT_EQ(recipe->environment.rotation_deg, 90);
}

TEST(RecipeInput, AnEnvironmentFileIsFoundBesideItsRecipeAndNamedByItsHash) {
  const Folder folder;
  folder.write("sky.hdr", "abc");
  RecipeOptions options;
  options.file = folder.write("r.json", R"({"environment":{"file":"sky.hdr"}})");
  const auto loaded = load_recipe(options, true);
  ASSERT_TRUE(loaded);
  EXPECT_EQ(loaded->environment_name, "sky.hdr");
  EXPECT_EQ(loaded->environment.size(), 3U);
  // SHA-256 of "abc": FIPS 180-2, appendix B.1.
  EXPECT_NE(loaded->document.find("ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"),
            std::string::npos);
}

TEST(RecipeInput, ALightThatIsNeitherFileNorColourNorNameIsNotFound) {
  for (const char* name : {"nosky.hdr", "1,2", "red"}) {
    const auto light = load_light({name, std::nullopt, std::nullopt});
    ASSERT_FALSE(light) << name;
    EXPECT_EQ(light.error().exit, ExitCode::not_found);
  }
  EXPECT_EQ(load_light({"builtin:nonesuch", std::nullopt, std::nullopt}).error().exit, ExitCode::rejected);
  EXPECT_EQ(load_light({"-1,0,0", std::nullopt, std::nullopt}).error().exit, ExitCode::rejected);
  const auto none = load_light({});
  ASSERT_TRUE(none);
  EXPECT_FALSE(*none);
}

}  // namespace
}  // namespace kiln
