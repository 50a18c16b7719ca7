// r-RFs in a scene.glb: what is written is read back within the stated error, and what is not right is refused.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/artifact/glb.h"
#include "core/artifact/progressive_glb.h"
#include "core/base/random.h"
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
  const auto code = [&](const std::string& from, const std::string& to) -> std::string {
    const auto read = read_baked_glb(with_json(file, from, to));
    return read ? "read" : read.error().code;
  };
  EXPECT_EQ(code("\"degree\":2", "\"degree\":3"), "slot_count_mismatch");
  EXPECT_EQ(code("\"degree\":2", "\"degree\":9"), "number_out_of_range");
  EXPECT_EQ(code("\"degree\":2", "\"degree\":-1"), "json_type");
  EXPECT_EQ(code("\"reflected\":true", "\"reflected\":false"), "not_a_baked_scene");
  EXPECT_EQ(code("\"_SLF_0\",\"_SLF_1\"", "\"_SLF_1\",\"_SLF_0\""), "slot_count_mismatch");
  EXPECT_EQ(code("\"KILN_light_field\":{\"version\":1", "\"KILN_light_field\":{\"version\":2"), "unsupported_version");
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
