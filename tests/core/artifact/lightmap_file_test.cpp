// Lightmaps as files: what is written comes back, and whatever bytes come end in a lightmap or a typed fault.

#include "core/artifact/lightmap_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/artifact/glb.h"
#include "core/base/random.h"
#include "tests/core/artifact/random_baked.h"

namespace kiln {
namespace {

/// Light from 0 to 1, but for one texel.
Lightmap random_map(float brightest) {
  Random random(3, 0);
  Lightmap out{.side = 32, .texels = {}, .parts = {1, 0, 1, 1}};
  for (int i = 0; i < 32 * 32; ++i) out.texels.push_back({random.uniform(), random.uniform(), random.uniform()});
  out.texels[77] = {brightest, 0, 0};
  return out;
}

const std::vector<char> kWritten{1, 1, 1, 0};  // the last part counts as one without triangles

Bytes plain() { return *write_baked_glb(random_baked({.order = 2, .side = 4})); }

nlohmann::json document_of(const Bytes& file) { return nlohmann::json::parse(split_glb(file)->json); }

TEST(LightmapFile, ExrComesBackButForTheRoundingOfPi) {
  const Lightmap map = random_map(1e6F);  // far beyond what halves hold
  const auto read = read_lightmap_exr(write_lightmap_exr(map, "{}"), "lightmap.exr");
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->side, 32);
  for (std::size_t i = 0; i < map.texels.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(read->texels[i][c], map.texels[i][c], 2.4e-7 * map.texels[i][c]);
  }
  EXPECT_FALSE(read_lightmap_exr(Bytes{1, 2, 3}, "lightmap.exr"));
}

TEST(LightmapFile, ImageIsWithinHalfAStepBelowItsRange) {
  const Bytes file = *add_lightmap(plain(), random_map(1), kWritten);
  const auto read = read_lightmap(file);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->parts, (std::vector<char>{1, 0, 1}));
  const Lightmap map = random_map(1);
  const double step =
      document_of(file)["extensions"]["KILN_lightmap"]["intensity"].get<double>() / std::numbers::pi / 255;
  EXPECT_NEAR(step, 1.0 / 255, 1e-6);
  for (std::size_t i = 0; i < map.texels.size(); ++i) EXPECT_NEAR(read->texels[i].x, map.texels[i].x, 0.501 * step);
}

double squared_error(const Lightmap& a, const Lightmap& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.texels.size(); ++i) {
    const Vec3d apart = to_double(a.texels[i]) - to_double(b.texels[i]);
    sum += dot(apart, apart) / 3;
  }
  return sum / static_cast<double>(a.texels.size());
}

TEST(LightmapFile, CutsOffOnlyWhatWouldCostMoreInRounding) {
  // One channel of 8 among 1024 x 3 numbers up to 1: to keep it costs each (8 / 255)^2 / 12 = 8.2e-5, to cut it off at
  // 1 costs 49 / 3072 = .016.
  const auto kept = read_lightmap(*add_lightmap(plain(), random_map(8), kWritten));
  ASSERT_TRUE(kept);
  EXPECT_NEAR(kept->texels[77].x, 8, 0.02);
  // One of 2 among 512 x 512 x 3: (2 / 255)^2 / 12 = 5.1e-6 to keep; 1 / 786432 + (1 / 255)^2 / 12 = 2.6e-6 to cut off.
  Lightmap many = random_map(1);
  many.side = 512;
  for (int k = 0; k < 8; ++k) many.texels.insert(many.texels.end(), many.texels.begin(), many.texels.end());
  many.texels[5] = {2, 0, 0};
  const auto cut = read_lightmap(*add_lightmap(plain(), many, kWritten));
  ASSERT_TRUE(cut);
  EXPECT_NEAR(cut->texels[5].x, 1, 0.01);
  EXPECT_NEAR(squared_error(*cut, many) / 2.6e-6, 1, 0.05);  // of two digits
}

TEST(LightmapFile, HasASceneOfItsOwnAndLeavesTheOthersAlone) {
  const Bytes before = plain(), after = *add_lightmap(before, random_map(1), kWritten);
  const nlohmann::json a = document_of(before), b = document_of(after);
  ASSERT_EQ(b["scenes"].size(), 3U);
  EXPECT_EQ(b["scene"], 0);
  for (const char* list : {"meshes", "materials", "nodes"}) {
    for (std::size_t i = 0; i < a[list].size(); ++i) EXPECT_EQ(a[list][i], b[list][i]) << list;
  }
  const auto& primitives = b["meshes"][2]["primitives"];
  ASSERT_EQ(primitives.size(), 3U);
  const auto& lit = b["materials"][primitives[0]["material"].get<std::size_t>()];
  EXPECT_EQ(lit["extensions"]["MOZ_lightmap"]["texCoord"], 1);
  EXPECT_FALSE(b["materials"][primitives[1]["material"].get<std::size_t>()]["extensions"].contains("MOZ_lightmap"));
  const auto baked = read_baked_glb(after), plainly = read_baked_glb(before);
  ASSERT_TRUE(baked) << baked.error().message;
  EXPECT_EQ(baked->scene.materials.size(), plainly->scene.materials.size());
  EXPECT_EQ(baked->transfer.coefficients, plainly->transfer.coefficients);
}

TEST(LightmapFile, NamesWhatIsWrong) {
  const Bytes file = *add_lightmap(plain(), random_map(1), kWritten);
  const auto fault_with = [&](const auto& change) {
    const auto chunks = *split_glb(file);
    nlohmann::json document = nlohmann::json::parse(chunks.json);
    change(document["extensions"]["KILN_lightmap"]);
    const auto read = read_lightmap(*join_glb(document.dump(), Bytes(chunks.binary.begin(), chunks.binary.end())));
    return read ? std::string("none") : read.error().code;
  };
  using Json = nlohmann::json;
  EXPECT_EQ(fault_with([](Json& e) { e["version"] = 2; }), "unsupported_version");
  EXPECT_EQ(fault_with([](Json& e) { e["size"] = 64; }), "image_invalid");
  EXPECT_EQ(fault_with([](Json& e) { e["size"] = 100000; }), "number_out_of_range");
  EXPECT_EQ(fault_with([](Json& e) { e["intensity"] = 0; }), "number_out_of_range");
  EXPECT_EQ(fault_with([](Json& e) { e["of"] = 1e9; }), "number_out_of_range");
  EXPECT_EQ(fault_with([](Json& e) { e["primitives"] = {0, 3}; }), "index_out_of_range");
  EXPECT_EQ(fault_with([](Json& e) { e["bufferView"] = 0; }), "image_invalid");
  EXPECT_EQ(fault_with([](Json& e) { e.erase("bufferView"); }), "index_out_of_range");
  EXPECT_EQ(read_lightmap(plain())->side, 0);
}

}  // namespace
}  // namespace kiln
