// No NaN or Inf in any artefact, and everything in it within its stated range.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "core/artifact/baked_scene.h"
#include "core/artifact/evaluate.h"
#include "tests/core/extremes/random_bake.h"
#include "tests/core/extremes/seeds.h"

namespace kiln::test {
namespace {

/// A number that is none becomes null in JSON.
void expect_no_null(const nlohmann::json& json, const std::string& place) {
  if (json.is_null()) ADD_FAILURE() << place << " is null";
  if (json.is_structured()) {
    for (const auto& [key, value] : json.items()) expect_no_null(value, place + "/" + key);
  }
}

nlohmann::json json_of_glb(const Bytes& file) {
  std::uint32_t length = 0;
  std::memcpy(&length, file.data() + 12, 4);
  return nlohmann::json::parse(file.begin() + 20, file.begin() + 20 + length);
}

void expect_finite(const BakedScene& baked) {
  const Mesh& mesh = baked.scene.mesh;
  for (const Vec3f& p : mesh.position) {
    EXPECT_LE(std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}), 0.5F);
  }
  for (const Vec3f& n : mesh.normal) EXPECT_NEAR(length(n), 1, 1e-5);
  for (const Vec4f& c : mesh.color) EXPECT_TRUE(c.x >= 0 && c.x <= 1 && c.y >= 0 && c.y <= 1 && c.z >= 0 && c.z <= 1);
  for (const float t : baked.transfer.coefficients) ASSERT_TRUE(std::isfinite(t));
  for (const Vec3f& l : baked.light.coefficients) EXPECT_TRUE(is_finite(l));
  for (const Vec3f& x : values_of(baked.transfer, baked.light.coefficients)) ASSERT_TRUE(is_finite(x));
  EXPECT_TRUE(std::isnormal(baked.exposure) && baked.exposure > 0);
  // The lamps' slot holds light: nowhere less than none, up to half a step of its grid and the fit's rounding.
  if (!baked.transfer.fixed) return;
  float brightest = 0;
  for (std::size_t v = 0; v < baked.transfer.vertices(); ++v) {
    for (int c = 0; c < 3; ++c) brightest = std::max(brightest, baked.transfer.at(v, c)[baked.transfer.slots() - 1]);
  }
  for (std::size_t v = 0; v < baked.transfer.vertices(); ++v) {
    for (int c = 0; c < 3; ++c) ASSERT_GE(baked.transfer.at(v, c)[baked.transfer.slots() - 1], -2.5e-4F * brightest);
  }
}

/// The fault's code, or "".
std::string check_bake(const BakeInput& input, Threads& threads) {
  const Result<BakeOutput> output = bake(input, {}, threads);
  if (!output) return output.error().code;
  const Bytes& glb = file_of(*output, "scene.glb");
  expect_no_null(json_of_glb(glb), "scene.glb");
  nlohmann::json report = report_of(*output);
  if (!input.recipe.certificate) report.erase("certificate");  // null says that there is none
  expect_no_null(report, "report.json");
  const Result<BakedScene> baked = read_baked_glb(glb);
  EXPECT_TRUE(baked) << baked.error().message;
  if (baked) expect_finite(*baked);
  EXPECT_GT(file_of(*output, "preview.png").size(), 100U);
  return "";
}

TEST(ArtifactProperty, NothingInAnyArtefactIsNotANumber) {
  Threads threads(2);
  int baked = 0, empty = 0;
  for_seeds(250, [&](std::uint64_t seed) {
    const std::string fault = check_bake(random_bake(seed, {.certificate = seed % 25 == 0}), threads);
    EXPECT_TRUE(fault.empty() || fault == "empty_scene") << fault;
    fault.empty() ? ++baked : ++empty;
  });
  EXPECT_GE(baked, empty);  // the generator makes scenes, not rubbish only
}

}  // namespace
}  // namespace kiln::test
