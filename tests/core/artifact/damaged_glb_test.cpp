// Whatever bytes come, read_baked_glb answers with a scene or a typed fault.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "core/artifact/glb.h"
#include "core/base/random.h"
#include "tests/core/artifact/random_baked.h"

namespace kiln {
namespace {

Bytes sample_file() { return *write_baked_glb(random_baked({.order = 2, .fixed = true, .side = 4})); }

std::string code_of(std::span<const std::uint8_t> file) {
  const auto read = read_baked_glb(file);
  return read ? "" : read.error().code;
}

/// The file with its JSON text changed: every `from` becomes `to`.
Bytes with_json(const Bytes& file, const std::string& from, const std::string& to) {
  const auto chunks = split_glb(file);
  std::string json(chunks->json);
  EXPECT_NE(json.find(from), std::string::npos) << from;
  for (std::size_t at = 0; (at = json.find(from, at)) != std::string::npos; at += to.size()) {
    json.replace(at, from.size(), to);
  }
  return *join_glb(json, Bytes(chunks->binary.begin(), chunks->binary.end()));
}

/// What a caller may rely on after a successful read.
void expect_valid(const BakedScene& baked) {
  const Mesh& mesh = baked.scene.mesh;
  const std::size_t n = mesh.position.size();
  ASSERT_EQ(mesh.normal.size(), n);
  ASSERT_EQ(baked.transfer.vertices(), n);
  ASSERT_EQ(mesh.part.size(), mesh.triangles.size());
  for (const auto& size : {mesh.uv0.size(), mesh.uv1.size(), mesh.color.size(), mesh.tangent.size()}) {
    ASSERT_TRUE(size == 0 || size == n);
  }
  for (const Triangle& t : mesh.triangles) ASSERT_LT(std::max({t[0], t[1], t[2]}), n);
  for (const auto part : mesh.part) ASSERT_LT(part, baked.scene.parts.size());
  for (const Part& part : baked.scene.parts) {
    ASSERT_TRUE(part.material >= 0 && static_cast<std::size_t>(part.material) < baked.scene.materials.size());
  }
  for (const Vec3f& p : mesh.position) ASSERT_TRUE(is_finite(p));
  for (const Vec3f& p : mesh.normal) ASSERT_NEAR(length(p), 1, 0.02F);
  for (const float c : baked.transfer.coefficients) ASSERT_TRUE(std::isfinite(c));
  ASSERT_TRUE(baked.light.coefficients.empty() ||
              baked.light.coefficients.size() == static_cast<std::size_t>(sh_count(baked.transfer.order)));
}

TEST(DamagedGlb, FilesThatKilnDidNotWriteAreNamedSo) {
  const Bytes file = sample_file();
  EXPECT_EQ(code_of(with_json(file, "KILN_radiance_transfer", "KILN_something_else___")), "not_a_baked_scene");
  EXPECT_EQ(code_of(with_json(file, "\"condonShortley\":false", "\"condonShortley\":true")), "not_a_baked_scene");
}

TEST(DamagedGlb, EachBrokenPromiseHasItsCode) {
  const Bytes file = sample_file();
  EXPECT_EQ(code_of(with_json(file, "\"version\":2,", "\"version\":1,")), "unsupported_version");
  EXPECT_EQ(code_of(with_json(file, "\"order\":2", "\"order\":3")), "slot_count_mismatch");
  EXPECT_EQ(code_of(with_json(file, "\"order\":2", "\"order\":11")), "number_out_of_range");
  EXPECT_EQ(code_of(with_json(file, "\"order\":2", "\"order\":0")), "slot_count_mismatch");
  const Bytes without_lamps = *write_baked_glb(random_baked({.order = 2, .fixed = false, .side = 4}));
  EXPECT_EQ(code_of(with_json(without_lamps, "\"order\":2", "\"order\":0")), "number_out_of_range");
  EXPECT_EQ(code_of(with_json(file, "\"order\":2,", "")), "number_out_of_range");
  EXPECT_EQ(code_of(with_json(file, "\"channels\":3", "\"channels\":2")), "number_out_of_range");
  EXPECT_EQ(code_of(with_json(file, "\"channels\":3", "\"channels\":\"3\"")), "json_type");
  EXPECT_EQ(code_of(with_json(file, "\"exposure\":1", "\"exposure\":0")), "number_out_of_range");
  EXPECT_EQ(code_of(with_json(file, "\"_PRT_0\":", "\"_PRT_x\":")), "attribute_missing");
  EXPECT_EQ(code_of(with_json(file, "\"material\":1,\"albedo\"", "\"material\":7,\"albedo\"")), "index_out_of_range");
  EXPECT_EQ(code_of(with_json(file, "\"count\":25,", "\"count\":24,")), "draco_damaged");
  EXPECT_EQ(code_of(with_json(file, "\"count\":25,", "\"count\":26,")), "accessor_count_mismatch");
}

TEST(DamagedGlb, EveryTruncationIsAFault) {
  const Bytes file = sample_file();
  for (std::size_t size = 0; size < file.size(); size += 1 + size / 64) {
    EXPECT_NE(code_of(std::span(file).first(size)), "") << size;
  }
}

TEST(DamagedGlb, NoMutationCrashesTheReader) {
  const Bytes original = sample_file();
  const std::size_t json_end = 20 + split_glb(original)->json.size();
  int refused = 0;
  for (std::uint64_t seed = 0; seed < 2000; ++seed) {
    Random random(seed, 1);
    Bytes file = original;
    // Half of the cases damage the JSON, half the compressed geometry: one to eight bytes each.
    const bool in_json = seed % 2 == 0;
    const std::size_t begin = in_json ? 0 : json_end, size = in_json ? json_end : file.size() - json_end;
    for (std::uint64_t i = 0; i < 1 + seed % 8; ++i) {
      file[begin + random.next() % size] = static_cast<std::uint8_t>(random.next());
    }
    const auto read = read_baked_glb(file);
    if (read) expect_valid(*read);
    refused += read ? 0 : 1;
  }
  EXPECT_GT(refused, 500);  // most changes to JSON matter; many to entropy-coded values only change a value
}

TEST(DamagedGlb, HugeStatedSizesAreRefusedBeforeMemoryIsAsked) {
  Bytes file = sample_file();
  const auto chunk = split_glb(file)->binary;
  const auto draco = static_cast<std::size_t>(chunk.data() - file.data());
  ASSERT_EQ(std::memcmp(&file[draco], "DRACO", 5), 0);
  for (std::size_t i = 0; i < 4; ++i) file[draco + 12 + i] = 0xFF;  // the vertex count grows to 2^28 and more
  EXPECT_EQ(code_of(file), "draco_damaged");
}

}  // namespace
}  // namespace kiln
