// r-RFs in a scene.glb: what is written is read back within the stated error, and what is not right is refused.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/artifact/glb.h"
#include "core/artifact/progressive_glb.h"
#include "core/artifact/sky_levels.h"
#include "core/base/random.h"
#include "core/lightfield/field_lamp.h"
#include "core/lightfield/progressive_mesh.h"
#include "tests/core/artifact/random_baked.h"
#include "tests/core/artifact/round_trip.h"

namespace kiln {
namespace {

BakedScene with_field(int degree, float magnitude = 1) {
  BakedScene out = random_baked({.order = 1, .fixed = true, .side = 4});
  out.field.degree = degree;
  Random random(7, 0);
  const std::size_t numbers = 3 * out.field.count() * out.scene.mesh.position.size();
  for (std::size_t i = 0; i < numbers; ++i) out.field.coefficients.push_back(magnitude * (2 * random.uniform() - 1));
  return out;
}

/// The file with its JSON text changed: every `from` becomes `to`.
Bytes with_json(const Bytes& file, const std::string& from, const std::string& to) {
  const auto chunks = split_glb(file);
  std::string text(chunks->json);
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
  return *join_glb(text, Bytes(chunks->binary.begin(), chunks->binary.end()));
}

/// What reading says of the file with its JSON text changed.
std::string code_of(const Bytes& file, const std::string& from, const std::string& to) {
  const auto read = read_baked_glb(with_json(file, from, to));
  return read ? "read" : read.error().code;
}

TEST(LightFieldGlb, RawCoefficientsComeBackWithinHalfAStep) {
  for (const int degree : {0, 4, 8}) {
    for (const float magnitude : {1e-6F, 1.0F, 1e12F}) {
      const BakedScene written = with_field(degree, magnitude);
      const BakedScene read = round_trip(written);
      EXPECT_EQ(read.field.degree, degree);
      ASSERT_EQ(read.field.vertices(), read.scene.mesh.position.size());
      const auto original = original_vertices(read);
      double worst = 0;
      for (std::size_t v = 0; v < read.field.vertices(); ++v) {
        for (std::size_t i = 0; i < 3 * read.field.count(); ++i)
          worst = std::max<double>(worst, std::abs(read.field.of(v)[i] - written.field.of(original[v])[i]));
      }
      // Twelve bits over a range of at most twice the magnitude: half a step, and float rounding.
      EXPECT_LE(worst, 1.001 * double{magnitude} / 4095);
      EXPECT_GT(worst, 0.2 * double{magnitude} / 4095);
    }
  }
}

TEST(LightFieldGlb, AFileWithoutAFieldHasNone) {
  EXPECT_TRUE(round_trip(random_baked({.side = 4})).field.coefficients.empty());
  const Bytes file = *write_baked_glb(random_baked({.side = 4}));
  EXPECT_EQ(std::string(split_glb(file)->json).find("KILN_light_field"), std::string::npos);
}

TEST(LightFieldGlb, WhatIsNotRightIsRefusedByName) {
  const Bytes file = *write_baked_glb(with_field(2));
  const auto code = [&](const std::string& from, const std::string& to) { return code_of(file, from, to); };
  EXPECT_EQ(code("\"degree\":2", "\"degree\":3"), "slot_count_mismatch");
  EXPECT_EQ(code("\"degree\":2", "\"degree\":9"), "number_out_of_range");
  EXPECT_EQ(code("\"degree\":2", "\"degree\":-1"), "json_type");
  EXPECT_EQ(code("\"reflected\":true", "\"reflected\":false"), "not_a_baked_scene");
  EXPECT_EQ(code("\"_SLF_0\",\"_SLF_1\"", "\"_SLF_1\",\"_SLF_0\""), "slot_count_mismatch");
  EXPECT_EQ(code("\"KILN_light_field\":{\"version\":1", "\"KILN_light_field\":{\"version\":5"), "unsupported_version");
}

SkyLevels random_sky(float brightest) {
  SkyLevels out;
  Random random(11, 0);
  for (const int height : {4, 8, 16}) {
    Environment level{.name = {}, .width = 2 * height, .height = height, .radiance = {}};
    for (int i = 0; i < 2 * height * height; ++i) {
      const float bright = std::exp2(-20 * random.uniform()) * brightest;
      level.radiance.push_back({bright * random.uniform(), bright, bright * random.uniform()});
    }
    level.radiance[3] = {0, 0, 0};
    out.push_back(level);
  }
  return out;
}

BakedScene with_sky() {
  BakedScene out = with_field(2);
  Random random(9, 0);
  for (std::size_t i = 0; i < kVisibilityCount * out.scene.mesh.position.size(); ++i)
    out.field.visibility.push_back(4 * random.uniform() - 1);
  out.field.sky = {0.5F, 1, 2};
  out.field.sky_slope = 3;
  out.sky = random_sky(100);
  return out;
}

/// Largest difference between what was read and what was written of its vertices, as many numbers of each.
double worst_of(const std::vector<float>& read, const std::vector<float>& written,
                const std::vector<std::uint32_t>& original) {
  const std::size_t width = read.size() / original.size();
  double worst = 0;
  for (std::size_t i = 0; i < read.size(); ++i)
    worst = std::max<double>(worst, std::abs(read[i] - written[width * original[i / width] + i % width]));
  return worst;
}

TEST(LightFieldGlb, ASkyThatIsKeptApartTravelsWithTheField) {
  const BakedScene written = with_sky(), read = round_trip(written);
  ASSERT_TRUE(read.field.has_sky());
  EXPECT_EQ(read.field.sky, written.field.sky);
  EXPECT_EQ(read.field.sky_slope, written.field.sky_slope);
  const double worst = worst_of(read.field.visibility, written.field.visibility, original_vertices(read));
  EXPECT_LE(worst, 1.001 * 2 / 1023);  // ten bits over a range of at most 4: half a step
  ASSERT_EQ(read.sky.size(), written.sky.size());
  EXPECT_EQ(read.sky[2].height, 16);
}

TEST(LightFieldGlb, SharedExponentsKeepABrightTexelToHalfAStep) {
  for (const float brightest : {1e-6F, 1.0F, 3e9F}) {
    const SkyLevels sky = random_sky(brightest), back = unpack_sky(pack_sky(sky));
    for (std::size_t k = 0; k < sky.size(); ++k) {
      for (std::size_t i = 0; i < sky[k].radiance.size(); ++i) {
        const Vec3f off = back[k].radiance[i] - sky[k].radiance[i];
        const float most = std::max({std::abs(off.x), std::abs(off.y), std::abs(off.z)});
        // Half of 1/256 of a power of two at most the brightest channel; below 2^-24 of the largest there are no steps.
        EXPECT_LE(most, sky[k].radiance[i].y / 512 + brightest * std::exp2(-39.0F)) << brightest;
      }
    }
    EXPECT_EQ(back[0].radiance[3], (Vec3f{0, 0, 0}));
  }
}

TEST(LightFieldGlb, ASkyThatIsNotRightIsRefusedByName) {
  const Bytes file = *write_baked_glb(with_sky());
  const auto code = [&](const std::string& from, const std::string& to) { return code_of(file, from, to); };
  EXPECT_EQ(code("\"heights\":[4,8,16]", "\"heights\":[4,8,32]"), "slot_count_mismatch");
  EXPECT_EQ(code("\"heights\":[4,8,16]", "\"heights\":[16]"), "number_out_of_range");
  EXPECT_EQ(code("\"heights\":[4,8,16]", "\"heights\":[4,8,99999]"), "number_out_of_range");
  EXPECT_EQ(code("\"heights\":[4,8,16]", "\"heights\":[4,-8,16]"), "number_out_of_range");
  EXPECT_EQ(code("\"_SLF_SKY_0\",\"_SLF_SKY_1\"", "\"_SLF_SKY_1\",\"_SLF_SKY_0\""), "slot_count_mismatch");
  EXPECT_EQ(code("\"slope\":3.0", "\"slope\":-3.0"), "number_out_of_range");
  EXPECT_EQ(code("\"rows\":16", "\"rows\":15"), "slot_count_mismatch");
  EXPECT_EQ(code("\"mean\":[0.5,1.0,2.0]", "\"mean\":[0.5,1.0]"), "slot_count_mismatch");
}

BakedScene with_lamps() {
  BakedScene out = with_field(2);
  Light light{.type = LightType::directional, .name = {}, .intensity = {1, 2, 3}};
  light.direction = normalized(Vec3f{1, -2, 3});
  out.field.lamps.push_back(make_field_lamp(light, {0.5F, 1, 2}));
  light.type = LightType::point, light.position = {0.25F, 0.5F, -0.75F}, light.range = 3;
  out.field.lamps.push_back(make_field_lamp(light, {1, 1, 1}));
  light.type = LightType::spot, light.inner_cone = 0.25F, light.outer_cone = 0.5F;
  for (int k = 0; k < 3; ++k) out.field.lamps.push_back(make_field_lamp(light, {1, 1, 1}));
  Random random(13, 0);
  const std::size_t numbers = out.field.lamps.size() * out.scene.mesh.position.size();
  for (std::size_t i = 0; i < numbers; ++i) out.field.lamp_visibility.push_back(random.uniform());
  return out;
}

TEST(LightFieldGlb, LampsThatAreKeptApartTravelWithTheField) {
  const BakedScene written = with_lamps(), read = round_trip(written);
  const std::size_t count = written.field.lamps.size();
  ASSERT_EQ(read.field.lamps.size(), count);
  for (std::size_t k = 0; k < count; ++k) {
    const FieldLamp &a = written.field.lamps[k], &b = read.field.lamps[k];
    EXPECT_EQ(a.light.type, b.light.type);
    EXPECT_EQ(a.light.intensity, b.light.intensity);
    EXPECT_EQ(a.mean, b.mean);
    if (a.light.type != LightType::point) {
      EXPECT_EQ(a.light.direction, b.light.direction);
      EXPECT_EQ(a.lobe, b.lobe);
    }
    if (a.light.type != LightType::directional) {
      EXPECT_EQ(a.light.position, b.light.position);
      EXPECT_EQ(a.light.range, b.light.range);
    }
    if (a.light.type == LightType::spot) {
      EXPECT_EQ(a.light.outer_cone, b.light.outer_cone);
      EXPECT_EQ(a.light.inner_cone, b.light.inner_cone);
    }
  }
  const double worst = worst_of(read.field.lamp_visibility, written.field.lamp_visibility, original_vertices(read));
  EXPECT_LE(worst, 1.001 * 0.5 / 1023);  // ten bits over a range of at most 1: half a step
  EXPECT_GT(worst, 0.2 * 0.5 / 1023);
}

BakedScene with_diffuse() {
  BakedScene out = with_field(2);
  out.transfer = {0, 3, true, {}};
  Random random(17, 0);
  // Red numbers the vertices, as original_vertices() asks.
  for (std::size_t v = 0; v < out.scene.mesh.position.size(); ++v)
    for (std::size_t c = 0; c < 3; ++c)
      out.transfer.coefficients.push_back(c == 0 ? static_cast<float>(v) : 2 * random.uniform());
  out.light.coefficients.clear();
  out.field.diffuse = out.transfer.coefficients;
  out.field.diffuse_color = {0.5F, 0.25F, 0.75F};
  return out;
}

TEST(LightFieldGlb, DiffuseLightThatIsKeptApartIsTheTransfer) {
  const BakedScene written = with_diffuse(), read = round_trip(written);
  EXPECT_EQ(read.field.diffuse_color, written.field.diffuse_color);
  EXPECT_EQ(read.field.diffuse, read.transfer.coefficients);
  const double worst = worst_of(read.field.diffuse, written.field.diffuse, original_vertices(read));
  // Half a step of at least twelve bits over the range of red.
  EXPECT_LE(worst, 1.001 * static_cast<double>(written.scene.mesh.position.size()) / 2 / 4095);
  EXPECT_FALSE(round_trip(with_field(2)).field.has_diffuse());
}

TEST(LightFieldGlb, DiffuseLightThatIsNotRightIsRefusedByName) {
  const Bytes file = *write_baked_glb(with_diffuse());
  const auto code = [&](const std::string& from, const std::string& to) { return code_of(file, from, to); };
  EXPECT_EQ(code("\"mean\":[0.5,0.25,0.75]", "\"mean\":[0.5,-0.25,0.75]"), "number_out_of_range");
  EXPECT_EQ(code("\"mean\":[0.5,0.25,0.75]", "\"mean\":[0.5,0.25]"), "slot_count_mismatch");
  EXPECT_EQ(code("\"rows\":16", "\"rows\":17"), "slot_count_mismatch");
  // Beside a transfer of another order there is no such light.
  const Bytes other = with_json(*write_baked_glb(with_field(2)), "\"reflected\":true",
                                R"("reflected":true,"diffuse":{"mean":[1,1,1],"lobes":{"rows":16,"views":32}})");
  EXPECT_EQ(read_baked_glb(other).error().code, "not_a_baked_scene");
}

TEST(LightFieldGlb, AFileSaysTheVersionThatItNeeds) {
  const auto version = [](const BakedScene& scene) {
    const Bytes file = *write_baked_glb(scene);
    const std::string json(split_glb(file)->json), name = "\"KILN_light_field\":{\"version\":";
    return json.at(json.find(name) + name.size());
  };
  EXPECT_EQ(version(with_field(2)), '1');
  EXPECT_EQ(version(with_sky()), '1');  // readers of before know it
  EXPECT_EQ(version(with_lamps()), '2');
  BakedScene glowing = with_field(2);
  glowing.field.emission_apart = true;
  EXPECT_EQ(version(glowing), '3');
  EXPECT_EQ(version(with_diffuse()), '4');
  EXPECT_TRUE(read_baked_glb(*write_baked_glb(glowing))->field.emission_apart);
  EXPECT_FALSE(read_baked_glb(*write_baked_glb(with_field(2)))->field.emission_apart);
}

TEST(LightFieldGlb, LampsThatAreNotRightAreRefusedByName) {
  const Bytes file = *write_baked_glb(with_lamps());
  const auto code = [&](const std::string& from, const std::string& to) { return code_of(file, from, to); };
  EXPECT_EQ(code("\"type\":\"spot\"", "\"type\":\"area\""), "not_a_baked_scene");
  EXPECT_EQ(code("\"intensity\":[1.0,2.0,3.0]", "\"intensity\":[1.0,-2.0,3.0]"), "number_out_of_range");
  EXPECT_EQ(code("\"intensity\":[1.0,2.0,3.0]", "\"intensity\":[1.0,2.0]"), "json_type");
  EXPECT_EQ(code("\"range\":3.0", "\"range\":-3.0"), "number_out_of_range");
  EXPECT_EQ(code("\"outerConeAngle\":0.5", "\"outerConeAngle\":2"), "number_out_of_range");
  EXPECT_EQ(code("\"innerConeAngle\":0.25", "\"innerConeAngle\":0.75"), "number_out_of_range");
  EXPECT_EQ(code("\"direction\":[", "\"direction\":[5,0,0],\"other\":["), "number_out_of_range");
  EXPECT_EQ(code("\"mean\":[0.5,1.0,2.0]", "\"mean\":[-1,1.0,2.0]"), "number_out_of_range");
  EXPECT_EQ(code("\"_SLF_LAMP_0\",\"_SLF_LAMP_1\"", "\"_SLF_LAMP_1\",\"_SLF_LAMP_0\""), "slot_count_mismatch");
  EXPECT_EQ(code("\"lights\":[{", "\"lights\":[],\"others\":[{"), "number_out_of_range");
  EXPECT_EQ(code("\"KILN_light_field\":{\"version\":2", "\"KILN_light_field\":{\"version\":5"), "unsupported_version");
}

TEST(LightFieldGlb, AProgressiveMeshTravelsWithTheScene) {
  Threads threads(1);
  const BakedScene baked = with_field(1);
  const Bytes file = *write_baked_glb(baked);
  const SimplifyResult simple = simplify({baked.scene.mesh, baked.field}, {.triangles = 60, .record = true}, threads);
  const auto bytes = encode_progressive(progressive_mesh(simple.record));
  const Bytes with = *add_progressive(file, bytes);
  ASSERT_TRUE(read_baked_glb(with));
  const auto read = read_progressive(with);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(encode_progressive(*read), bytes);
  EXPECT_EQ(read_progressive(file)->levels(), 1U);  // none there
  EXPECT_TRUE(read_progressive(file)->all.mesh.triangles.empty());
  const auto refused = read_progressive(
      with_json(with, "\"KILN_progressive_mesh\":{\"version\":2", "\"KILN_progressive_mesh\":{\"version\":1"));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, "unsupported_version");
}

}  // namespace
}  // namespace kiln
