// Numbers at the end of their type, wherever a valid file may have them: a right result or a fault, never Inf or NaN.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/artifact/baked_scene.h"
#include "core/artifact/evaluate.h"
#include "tests/core/artifact/gltf_samples.h"
#include "tests/core/extremes/random_bake.h"

namespace kiln::test {
namespace {

struct Numbers {
  std::string material = "{}", node, extensions;
  std::vector<float> color = {}, uv = {};  // of the four corners
};

/// A floor of two triangles.
Bytes floor_with(const Numbers& n) {
  Sample s;
  s.positions({-1, 0, 1, 1, 0, 1, 1, 0, -1, -1, 0, -1});
  s.indices({0, 1, 2, 0, 2, 3});
  std::string attributes = "\"POSITION\":0";
  if (!n.color.empty()) {
    attributes += ",\"COLOR_0\":" + std::to_string(s.accessor(n.color, 5126, "VEC4", 4));
  }
  if (!n.uv.empty()) attributes += ",\"TEXCOORD_0\":" + std::to_string(s.accessor(n.uv, 5126, "VEC2", 4));
  return s.glb("\"materials\":[" + n.material + "],\"meshes\":[{\"primitives\":[{\"attributes\":{" + attributes +
               "},\"indices\":1,\"material\":0}]}],\"nodes\":[{\"mesh\":0}" + n.node + "],\"scenes\":[{\"nodes\":[0" +
               (n.node.empty() ? "" : ",1") + "]}],\"scene\":0" + n.extensions);
}

/// The code of the fault, or "" when all that was baked is finite.
std::string bake_floor(const Numbers& n, const std::string& light = R"({"constant":[1,1,1]})") {
  BakeInput input{.scene = {.name = "scene.glb", .main = floor_with(n)}};
  input.recipe = parse_recipe(R"({"certificate":false,"steps":[{"do":"prt","order":2,"samples":16,"bounces":2,)"
                              R"("subdivide":{"triangles":64}}],"environment":)" +
                              light + "}")
                     .value();
  Threads threads(2);
  const Result<BakeOutput> output = bake(input, {}, threads);
  if (!output) return output.error().code;
  const Result<BakedScene> baked = read_baked_glb(file_of(*output, "scene.glb"));
  EXPECT_TRUE(baked) << baked.error().message;
  if (!baked) return "unreadable";
  for (const float t : baked->transfer.coefficients) EXPECT_TRUE(std::isfinite(t));
  for (const Vec3f& x : values_of(baked->transfer, baked->light.coefficients)) EXPECT_TRUE(is_finite(x));
  for (const Vec2f& uv : baked->scene.mesh.uv0) EXPECT_TRUE(std::isfinite(uv.x) && std::isfinite(uv.y));
  nlohmann::json report = report_of(*output);
  report.erase("certificate");                                // null: there is none
  EXPECT_EQ(report.dump().find(":null"), std::string::npos);  // what is not finite becomes null
  return "";
}

TEST(Numbers, TextureCoordinatesOfAnySizeAreCarried) {
  for (const float size : {1e-38F, 1e9F, 1e30F, 3e38F}) {
    EXPECT_EQ(bake_floor({.uv = {-size, 0, size, size, 0, -size, 1, 1}}), "") << size;
  }
}

TEST(Numbers, VertexColoursOfAnySizeAreTakenIntoZeroAndOne) {
  for (const float size : {1e-38F, 1e10F, 3e38F}) {
    EXPECT_EQ(bake_floor({.color = {size, -size, 0, 1, 1, 1, 1, 1, size, size, size, size, -size, 0, 0, 0}}), "")
        << size;
  }
}

std::string emitter(const std::string& factor, const std::string& strength) {
  return "{\"emissiveFactor\":[" + factor +
         ",1,0],\"extensions\":{\"KHR_materials_emissive_strength\":"
         "{\"emissiveStrength\":" +
         strength + "}}}";
}

TEST(Numbers, EmissionIsFiniteOrRefused) {
  for (const char* strength : {"1e-38", "1e20", "1e30"}) {
    EXPECT_EQ(bake_floor({.material = emitter("1", strength)}), "") << strength;
  }
  for (const char* strength : {"1e21", "1e29"}) {  // the product passes what a float holds
    EXPECT_EQ(bake_floor({.material = emitter("1e10", strength)}), "light_out_of_range") << strength;
  }
  EXPECT_EQ(bake_floor({.material = emitter("1", "1e39")}), "number_out_of_range");
}

Numbers lamp(const std::string& type, const std::string& intensity, const std::string& height) {
  return {
      .node = ",{\"translation\":[0," + height +
              ",0],\"rotation\":[-0.70710678,0,0,0.70710678],\"extensions\":{\"KHR_lights_punctual\":{\"light\":0}}}",
      .extensions = ",\"extensions\":{\"KHR_lights_punctual\":{\"lights\":[{\"type\":\"" + type +
                    "\",\"intensity\":" + intensity + "}]}}"};
}

TEST(Numbers, LampsAreFiniteOrRefused) {
  for (const char* type : {"point", "spot", "directional"}) {
    for (const char* height : {"0", "1e-6", "1e-5", "1"}) {
      for (const char* intensity : {"1e-30", "1e8", "1e20"}) {
        EXPECT_EQ(bake_floor(lamp(type, intensity, height)), "") << type << ' ' << intensity << ' ' << height;
      }
    }
    EXPECT_EQ(bake_floor(lamp(type, "1e300", "1")), "number_out_of_range") << type;
  }
  // 1e30 over (3e-6)^2 would be more than a float holds.
  for (const char* type : {"point", "spot"}) {
    EXPECT_EQ(bake_floor(lamp(type, "1e30", "1e-5")), "light_out_of_range") << type;
  }
}

TEST(Numbers, AConstantSkyOfAnySizeThatARecipeAllowsStaysFinite) {
  for (const char* light : {R"({"constant":[1e-30,0,1e9]})", R"({"constant":[1e9,1e9,1e9],"intensity":1e9})",
                            R"({"builtin":"clear","intensity":1e9})"}) {
    const auto recipe = parse_recipe(std::string(R"({"environment":)") + light + "}");
    if (recipe) {
      EXPECT_EQ(bake_floor({}, light), "") << light;
    }
  }
}

}  // namespace
}  // namespace kiln::test
