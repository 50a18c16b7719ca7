// Matrices in a scene.glb: what is written is read back within the stated error, and what is not right is refused.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/artifact/eye.h"
#include "core/artifact/glb.h"
#include "core/base/random.h"
#include "core/sphere/quadrature.h"
#include "core/sphere/sh.h"
#include "tests/core/artifact/random_baked.h"
#include "tests/core/artifact/round_trip.h"

namespace kiln {
namespace {

/// A random scene whose parts 1 and 3 have random matrices of `rank` components.
BakedScene glossy_baked(int channels, bool fixed, std::size_t rank = 6) {
  BakedScene out = random_baked({.order = 3, .channels = channels, .fixed = fixed, .side = 4});
  GlossyTransfer& g = out.glossy;
  g = {.order = 3, .channels = channels, .fixed = fixed};
  std::vector<bool> has(out.scene.mesh.position.size(), false);
  for (std::size_t t = 0; t < out.scene.mesh.triangles.size(); ++t) {
    for (const auto v : out.scene.mesh.triangles[t]) has[v] = out.scene.mesh.part[t] % 2 == 1;
  }
  for (std::uint32_t v = 0; v < has.size(); ++v) {
    if (has[v]) g.vertices.push_back(v);
  }
  Random random(5, 0);
  const auto fill = [&](std::vector<float>& numbers, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) numbers.push_back(2 * random.uniform() - 1);
  };
  g.components.stride = g.stride();
  fill(g.components.rows, (rank + 1) * g.stride());
  fill(g.weights, rank * g.vertices.size());
  out.lobes = make_lobe_table(3);
  return out;
}

TEST(GlossyGlb, WeightsComeBackWithinHalfAStepAndAllElseExactly) {
  for (const int channels : {1, 3}) {
    for (const bool fixed : {false, true}) {
      const BakedScene written = glossy_baked(channels, fixed);
      const BakedScene read = round_trip(written, {.glossy_step = 0.01});
      const GlossyTransfer &a = written.glossy, &b = read.glossy;
      EXPECT_EQ(b.order, 3);
      EXPECT_EQ(b.channels, channels);
      EXPECT_EQ(b.fixed, fixed);
      EXPECT_EQ(b.components.rows, a.components.rows);
      EXPECT_EQ(read.lobes.numbers, written.lobes.numbers);
      ASSERT_EQ(b.vertices.size(), a.vertices.size());
      const auto original = original_vertices(read);
      double worst = 0;
      for (std::size_t n = 0; n < b.vertices.size(); ++n) {
        const std::size_t from = a.find(original[b.vertices[n]]);
        ASSERT_NE(from, GlossyTransfer::kNoMatrix);
        for (std::size_t k = 0; k < a.rank(); ++k)
          worst = std::max<double>(worst, std::abs(a.weights[from * a.rank() + k] - b.weights[n * b.rank() + k]));
      }
      EXPECT_LE(worst, 0.005 + 1e-6);  // half a step, and float rounding
      EXPECT_GT(worst, 0.001);         // of hundreds of weights some are rounded by nearly half a step of 2 / 255
    }
  }
}

TEST(GlossyGlb, OnlyPartsWithMatricesHaveTheirAttributes) {
  const Bytes file = *write_baked_glb(glossy_baked(3, false));
  const std::string json(split_glb(file)->json);
  std::size_t count = 0;
  for (std::size_t at = 0; (at = json.find("\"glossy\":true", at)) != std::string::npos; ++at) ++count;
  EXPECT_EQ(count, 2U);
  const BakedScene read = *read_baked_glb(file);
  for (std::size_t t = 0; t < read.scene.mesh.triangles.size(); ++t)
    EXPECT_EQ(has_matrices(read.glossy, read.scene.mesh.triangles[t]), read.scene.mesh.part[t] % 2 == 1);
}

TEST(GlossyGlb, WithoutMatricesTheFileIsTheSameByteForByte) {
  BakedScene plain = glossy_baked(3, true);
  const Bytes left_out = *write_baked_glb(plain, {.glossy = false});
  plain.glossy = {};
  plain.lobes = {};
  EXPECT_EQ(*write_baked_glb(plain), left_out);
  EXPECT_EQ(std::string(split_glb(left_out)->json).find("lossy"), std::string::npos);
}

TEST(GlossyGlb, SmoothMetalUnderConstantLightShowsItsReflectanceTimesWhatArrives) {
  BakedScene baked = glossy_baked(1, false);
  // Matrices and transfer vectors of an open point.
  GlossyTransfer& g = baked.glossy;
  std::fill(g.components.rows.begin(), g.components.rows.end(), 0.0F);
  for (const SphereNode& node : sphere_quadrature(1000)) {
    std::array<double, 9> y;
    evaluate_sh(3, node.direction, y.data());
    for (std::size_t k = 0; k < 81 && node.direction.y > 0; ++k)
      g.components.rows[k] += static_cast<float>(node.weight * y[k / 9] * y[k % 9]);
  }
  for (std::size_t v = 0; v < baked.transfer.vertices(); ++v) {
    float* t = &baked.transfer.coefficients[v * baked.transfer.stride()];
    std::fill_n(t, baked.transfer.stride(), 0.0F);
    t[0] = 0.28209479F;
  }
  std::vector<Vec3f> light(9);
  light[0] = Vec3f{1, 2, 3} * 3.5449077F;
  const EyeLight all = eye_light(baked, light, true);
  const Triangle triangle = baked.scene.mesh.triangles[baked.scene.mesh.triangles.size() - 1];
  const Vec3d n{0, 1, 0}, v{0.6, 0.8, 0}, gold{1, 0.8, 0.4};
  const EyeRadiance metal = eye_radiance(baked, all, {{triangle, 0.2F, 0.3F}, n, v, {gold, {}, gold, 0}});
  // Schlick at 0.8: F0 + (1 - F0) 0.2^5 = F0 + 3.2e-4 (1 - F0); interpolation between views 2e-3, the quadrature 2e-3.
  EXPECT_NEAR(metal.specular.x, 1, 0.01);
  EXPECT_NEAR(metal.specular.y, 2 * 0.8, 0.016);
  EXPECT_NEAR(metal.specular.z, 3 * 0.4, 0.012);
  EXPECT_EQ(metal.diffuse, Vec3d{});
  // White dielectric: never more than arrives, and no less than what one scattering off a smooth surface loses.
  const Vec3d white{1, 1, 1}, f0{0.04, 0.04, 0.04};
  const EyeRadiance paint = eye_radiance(baked, all, {{triangle, 0.2F, 0.3F}, n, v, {white, white, f0, 0.3}});
  EXPECT_NEAR((paint.diffuse + paint.specular).x, 1, 1e-3);  // 5e-3 of the specular part
  // Another part has no matrices: all of it is diffuse.
  const EyeRadiance other =
      eye_radiance(baked, all, {{baked.scene.mesh.triangles[0], 0.2F, 0.3F}, n, v, {gold, {}, gold, 0}});
  EXPECT_EQ(other.specular, Vec3d{});
  EXPECT_NEAR(other.diffuse.y, 1.6, 1e-5);
}

/// The file with its JSON text changed: every `from` becomes `to`.
Bytes with_json(const Bytes& file, const std::string& from, const std::string& to) {
  const auto chunks = split_glb(file);
  std::string json(chunks->json);
  EXPECT_NE(json.find(from), std::string::npos) << from;
  for (std::size_t at = 0; (at = json.find(from, at)) != std::string::npos; at += to.size())
    json.replace(at, from.size(), to);
  return *join_glb(json, Bytes(chunks->binary.begin(), chunks->binary.end()));
}

std::string code_of(std::span<const std::uint8_t> file) {
  const auto read = read_baked_glb(file);
  return read ? "" : read.error().code;
}

TEST(GlossyGlb, EachBrokenPromiseHasItsCode) {
  const Bytes file = *write_baked_glb(glossy_baked(3, true));
  ASSERT_EQ(code_of(file), "");
  const std::string root = "\"glossy\":{\"order\":3,\"channels\":3,\"fixed\":true,";
  const auto changed = [&](const std::string& text) { return code_of(with_json(file, root, text)); };
  EXPECT_EQ(changed("\"glossy\":{\"order\":4,\"channels\":3,\"fixed\":true,"), "number_out_of_range");
  EXPECT_EQ(changed("\"glossy\":{\"order\":0,\"channels\":3,\"fixed\":true,"), "number_out_of_range");
  EXPECT_EQ(changed("\"glossy\":{\"order\":3,\"channels\":2,\"fixed\":true,"), "number_out_of_range");
  EXPECT_EQ(changed("\"glossy\":{\"order\":3,\"channels\":1,\"fixed\":true,"), "slot_count_mismatch");
  EXPECT_EQ(changed("\"glossy\":{\"order\":3,\"channels\":3,\"fixed\":false,"), "slot_count_mismatch");
  EXPECT_EQ(changed("\"shiny\":{\"order\":3,\"channels\":3,\"fixed\":true,"), "not_a_baked_scene");
  EXPECT_EQ(code_of(with_json(file, "\"rank\":6", "\"rank\":5")), "slot_count_mismatch");
  EXPECT_EQ(code_of(with_json(file, "\"rank\":6", "\"rank\":0")), "number_out_of_range");
  EXPECT_EQ(code_of(with_json(file, "\"rank\":6", "\"rank\":1000000000")), "number_out_of_range");
  EXPECT_EQ(code_of(with_json(file, "\"views\":32", "\"views\":33")), "slot_count_mismatch");
  EXPECT_EQ(code_of(with_json(file, "\"views\":32,\"bufferView\":", "\"views\":32,\"bufferView\":9")),
            "slot_count_mismatch");
  EXPECT_EQ(code_of(with_json(file, "\"glossy\":true", "\"glossy\":1")), "json_type");
  EXPECT_EQ(code_of(with_json(file, "\"_GLOSSY_1\":", "\"_GLOSSY_x\":")), "attribute_missing");
}

TEST(GlossyGlb, NumbersThatAreNoneAreRefused) {
  BakedScene baked = glossy_baked(3, false);
  baked.glossy.components.rows[7] = std::numeric_limits<float>::infinity();
  EXPECT_EQ(code_of(*write_baked_glb(baked)), "number_out_of_range");
  baked = glossy_baked(3, false);
  baked.lobes.numbers[7] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(code_of(*write_baked_glb(baked)), "number_out_of_range");
}

TEST(GlossyGlb, NoMutationCrashesTheReader) {
  const Bytes original = *write_baked_glb(glossy_baked(3, true));
  int refused = 0;
  for (std::uint64_t seed = 0; seed < 500; ++seed) {
    Random random(seed, 1);
    Bytes file = original;
    for (std::uint64_t i = 0; i < 1 + seed % 8; ++i)
      file[random.next() % file.size()] = static_cast<std::uint8_t>(random.next());
    const auto read = read_baked_glb(file);
    refused += read ? 0 : 1;
    if (!read || !read->glossy) continue;
    const GlossyTransfer& g = read->glossy;
    ASSERT_EQ(g.weights.size(), g.vertices.size() * g.rank());
    ASSERT_TRUE(std::ranges::all_of(g.weights, [](float w) { return std::isfinite(w); }));
    ASSERT_TRUE(g.vertices.empty() || g.vertices.back() < read->scene.mesh.position.size());
  }
  EXPECT_GT(refused, 50);
}

}  // namespace
}  // namespace kiln
