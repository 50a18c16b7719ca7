// The built program as a user meets it: exit codes, streams, formats. No server.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "client_cli/arguments.h"
#include "tests/client_cli/run_kiln.h"
#include "tests/core/artifact/radiance_samples.h"

namespace kiln {
namespace {

using nlohmann::json;

constexpr const char* kValuesHead =
    "x,y,z,nx,ny,nz,irradiance_r,irradiance_g,irradiance_b,radiance_r,radiance_g,radiance_b\n";

TEST(Program, EveryCommandHasHelp) {
  for (const CommandWords& command : command_words()) {
    const Ran ran = run_kiln({command.name, "--help"});
    EXPECT_EQ(ran.exit, 0) << command.name;
    EXPECT_NE(ran.out.find("--json"), std::string::npos) << command.name;
    EXPECT_EQ(ran.err, "") << command.name;
    EXPECT_EQ(run_kiln({"help", command.name}).out, ran.out) << command.name;
  }
  const Ran all = run_kiln({"help"});
  EXPECT_EQ(all.exit, 0);
  for (const CommandWords& command : command_words()) EXPECT_NE(all.out.find(command.name), std::string::npos);
}

TEST(Program, WrongUsageEndsWithTwoAndSaysSoOnStderr) {
  for (const std::vector<std::string>& words :
       std::vector<std::vector<std::string>>{{},
                                             {"bakke"},
                                             {"bake"},
                                             {"bake", "a.glb", "--no-such"},
                                             {"completion", "tcsh"},
                                             {"watch", "01JX"},
                                             {"reference", "a.glb", "--points", "p.csv", "--samples", "none"},
                                             {"list", "--server", "ftp://x"}}) {
    const Ran ran = run_kiln(words);
    EXPECT_EQ(ran.exit, 2) << (words.empty() ? "" : words[0]);
    EXPECT_EQ(ran.out, "");
    EXPECT_NE(ran.err, "");
  }
}

TEST(Program, WhatIsNotThereEndsWithFiveAndIsNamed) {
  for (const std::vector<std::string>& words :
       std::vector<std::vector<std::string>>{{"bake", "nowhere.glb"},
                                             {"inspect", "nowhere.glb"},
                                             {"points", "nowhere.glb"},
                                             {"compare", "nowhere.glb", "x.csv"},
                                             {"plan", "nowhere.glb", "--local"}}) {
    const Ran ran = run_kiln(words);
    EXPECT_EQ(ran.exit, 5) << words[0] << ": " << ran.err;
    EXPECT_NE(ran.err.find("nowhere.glb"), std::string::npos);
  }
}

TEST(Program, AServerThatIsNotThereEndsWithSix) {
  // Port 1 is tcpmux: nobody listens there.
  const Ran ran = run_kiln({"list", "--server", "http://127.0.0.1:1"});
  EXPECT_EQ(ran.exit, 6) << ran.err;
  EXPECT_NE(ran.err.find("127.0.0.1:1"), std::string::npos);
  EXPECT_EQ(run_kiln({"list"}, {{"KILN_SERVER", "http://127.0.0.1:1"}}).exit, 6);
}

TEST(Program, ARejectedRecipeEndsWithSevenAndNamesEveryMistake) {
  const Folder folder;
  const auto scene = folder.write("plane.gltf", plane_gltf());
  const auto recipe = folder.write("r.json", R"({"steps":[{"do":"prt","order":99,"samples":"many"}],"colour":1})");
  const Ran ran = run_kiln({"bake", scene, "-r", recipe, "-o", folder.path("out")});
  EXPECT_EQ(ran.exit, 7) << ran.err;
  for (const char* pointer : {"/steps/0/order", "/steps/0/samples", "/colour"})
    EXPECT_NE(ran.err.find(pointer), std::string::npos) << pointer;
  const Ran as_json = run_kiln({"bake", scene, "-r", recipe, "--json"});
  EXPECT_EQ(json::parse(as_json.err).at("errors").size(), 3U);
  EXPECT_EQ(run_kiln({"bake", scene, "--preset", "nonesuch"}).exit, 7);
  EXPECT_EQ(run_kiln({"bake", scene, "-r", folder.write("x.json", "{\"steps\":")}).exit, 7);
}

TEST(Program, ARejectedSceneEndsWithSeven) {
  const Folder folder;
  const Ran ran = run_kiln({"points", folder.write("s.gltf", R"({"asset":{"version":"2.0"},"meshes":7})")});
  EXPECT_EQ(ran.exit, 7) << ran.err;
  EXPECT_EQ(ran.out, "");
}

TEST(Program, ErrorsHaveNoColourWhereNobodyLooks) {
  EXPECT_EQ(run_kiln({"inspect", "nowhere.glb"}).err.find('\033'), std::string::npos);
}

TEST(Inspect, SaysWhatLightAFileCarries) {
  const Folder folder;
  const Bytes file = test::radiance_triangle(RadianceBasis::polynomials, 4, true).glb();
  const std::string path = folder.write("captured.glb", std::string(file.begin(), file.end()));
  const Ran text = run_kiln({"inspect", path});
  EXPECT_EQ(text.exit, 0) << text.err;
  EXPECT_NE(text.out.find("radiance functions of degree 4 at 3 vertices (polynomial, reflected)"), std::string::npos)
      << text.out;
  const json facts = json::parse(run_kiln({"inspect", "--json", path}).out);
  EXPECT_EQ(facts["light_field"]["coefficients"], 75);  // kept as harmonics
  EXPECT_EQ(facts["radiance_functions"]["degree"], 4);
}

TEST(Compare, IsAGateWithExitCodeEight) {
  const Folder folder;
  std::string a = kValuesHead, b = kValuesHead;
  for (int i = 0; i < 50; ++i) {
    const std::string point = std::to_string(i) + ",0,0,0,1,0,";
    a += point + "1.1,1.1,1.1,0.35,0.35,0.35\n";  // 10 % above
    b += point + "1,1,1,0.318,0.318,0.318\n";
  }
  const auto fa = folder.write("a.csv", a), fb = folder.write("b.csv", b);
  EXPECT_EQ(run_kiln({"compare", fa, fb, "--max-error", "0.11"}).exit, 0);
  EXPECT_EQ(run_kiln({"compare", fa, fb, "--max-error", "0.09"}).exit, 8);
  const Ran ran = run_kiln({"compare", fa, fb, "--json"});
  const json out = json::parse(ran.out);
  EXPECT_NEAR(out.at("relrmse").get<double>(), 0.1, 1e-12);  // double rounding
  EXPECT_NEAR(out.at("bias").get<double>(), 0.1, 1e-12);
  EXPECT_EQ(out.at("points"), 50);
  EXPECT_EQ(run_kiln({"compare", fa, folder.write("c.csv", "x,y,z\n1,2,3\n")}).exit, 7);
}

TEST(Completion, BashCompletesCommandsOptionsAndPresets) {
  const Folder folder;
  const Ran script = run_kiln({"completion", "bash"});
  ASSERT_EQ(script.exit, 0);
  const auto file = folder.write("c.bash", script.out);
  const auto complete = [&](const std::string& words, int at) {
    const std::string command = "bash -c 'source " + file + "; COMP_WORDS=(" + words +
                                "); COMP_CWORD=" + std::to_string(at) + "; _kiln; echo \"${COMPREPLY[@]}\"' > " +
                                folder.path("reply");
    return std::system(command.c_str()) == 0 ? folder.read("reply") : std::string("failed");
  };
  EXPECT_EQ(complete("kiln ba", 1), "bake\n");
  EXPECT_EQ(complete("kiln bake --pre", 2), "--preset\n");
  EXPECT_NE(complete("kiln bake --preset prt", 3).find("prt-draft"), std::string::npos);
  EXPECT_EQ(complete("kiln completion z", 2), "zsh\n");
  for (const char* shell : {"zsh", "fish"})
    EXPECT_NE(run_kiln({"completion", shell}).out.find("compare"), std::string::npos);
}

TEST(Presets, AreListedWithTheirRecipes) {
  const json list = json::parse(run_kiln({"presets", "--json"}).out).at("presets");
  ASSERT_FALSE(list.empty());
  for (const json& preset : list) EXPECT_TRUE(preset.at("recipe").is_object());
}

}  // namespace
}  // namespace kiln
