// KILN_meshless_light, version 2: what is written comes back, and whatever bytes come end in points or a typed fault.

#include "core/artifact/points_glb.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/artifact/glb.h"
#include "core/artifact/links_glb.h"
#include "core/base/random.h"
#include "tests/core/artifact/random_baked.h"

namespace kiln {
namespace {

PointField random_field() {
  Random random(11, 0);
  PointField out;
  out.level_end = {10, 10, 60};
  for (std::uint32_t p = 0; p < 60; ++p) {
    out.sites.push_back({{random.uniform() - 0.5F, 0, 0.5F}, {1, -127, 3}, static_cast<std::uint8_t>(p < 10 ? 0 : 2)});
    out.radius.push_back(0.01F + random.uniform());
    out.coefficients.push_back({random.uniform(), -random.uniform(), 0});
  }
  return out;
}

struct Sample {
  BakedScene baked;
  Bytes plain, file;
};

Sample sample() {
  Sample out{.baked = random_baked({.order = 2, .side = 4}), .plain = {}, .file = {}};
  out.plain = *write_baked_glb(out.baked);
  out.file = *add_points(out.plain, random_field());
  return out;
}

std::string fault_of(const Bytes& file) {
  const auto read = read_points(file);
  return read ? "none" : read.error().code;
}

/// The file with its extension changed.
template <class Change>
Bytes changed(const Bytes& file, const Change& change) {
  const auto chunks = *split_glb(file);
  nlohmann::json document = nlohmann::json::parse(chunks.json);
  change(document, document["extensions"]["KILN_meshless_light"]);
  return *join_glb(document.dump(), Bytes(chunks.binary.begin(), chunks.binary.end()));
}

/// The file with the first bytes of an array replaced.
Bytes overwritten(const Bytes& file, const char* array, const std::vector<std::uint8_t>& with) {
  const auto chunks = *split_glb(file);
  const nlohmann::json document = nlohmann::json::parse(chunks.json);
  const auto& view =
      document["bufferViews"][document["extensions"]["KILN_meshless_light"]["bufferViews"][array].get<std::size_t>()];
  Bytes binary(chunks.binary.begin(), chunks.binary.end());
  std::copy(with.begin(), with.end(), binary.begin() + view["byteOffset"].get<std::ptrdiff_t>());
  return *join_glb(std::string(chunks.json), std::move(binary));
}

TEST(PointsGlb, ComeBackBitForBitAndTheSceneStaysReadable) {
  const Sample s = sample();
  const auto read = read_points(s.file);
  ASSERT_TRUE(read) << read.error().message;
  const PointField written = random_field();
  EXPECT_EQ(read->level_end, written.level_end);
  EXPECT_EQ(read->radius, written.radius);
  ASSERT_EQ(read->coefficients.size(), 60U);
  EXPECT_EQ(std::memcmp(read->sites.data(), written.sites.data(), 60 * sizeof(RowSite)), 0);
  EXPECT_EQ(std::memcmp(read->coefficients.data(), written.coefficients.data(), 60 * sizeof(Vec3f)), 0);
  const auto baked = read_baked_glb(s.file);
  ASSERT_TRUE(baked) << baked.error().message;
  const auto links = read_links(s.file, *baked);
  ASSERT_TRUE(links) << links.error().message;
  EXPECT_EQ(links->senders, 0U);  // version 2 has none
  EXPECT_TRUE(read_points(s.plain)->sites.empty());
}

TEST(PointsGlb, OfNoPointsHaveNoArrays) {
  const Bytes file = *add_points(sample().plain, {});
  const auto read = read_points(file);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_TRUE(read->sites.empty());
}

TEST(PointsGlb, NameWhatIsWrong) {
  const Bytes file = sample().file;
  using Json = nlohmann::json;
  const auto with = [&](const auto& change) { return fault_of(changed(file, change)); };
  EXPECT_EQ(with([](Json&, Json& e) { e["version"] = 3; }), "unsupported_version");
  EXPECT_EQ(with([](Json&, Json& e) { e["levels"] = {10, 5, 60}; }), "index_out_of_range");
  EXPECT_EQ(with([](Json&, Json& e) { e["levels"] = {10, 10, 61}; }), "index_out_of_range");
  EXPECT_EQ(with([](Json&, Json& e) { e["levels"] = {9, 9, 60}; }), "index_out_of_range");  // a site says otherwise
  EXPECT_EQ(with([](Json&, Json& e) { e["levels"] = "many"; }), "json_type");
  EXPECT_EQ(with([](Json&, Json& e) { e["bufferViews"].erase("radii"); }), "slot_count_mismatch");
  EXPECT_EQ(with([](Json&, Json& e) { e["bufferViews"]["sites"] = e["bufferViews"]["coefficients"]; }),
            "slot_count_mismatch");
  EXPECT_EQ(with([](Json&, Json& e) { e["bufferViews"]["sites"] = 100000; }), "index_out_of_range");
  const std::vector<std::uint8_t> nan{0, 0, 0xC0, 0x7F}, zero{0, 0, 0, 0};
  EXPECT_EQ(fault_of(overwritten(file, "sites", nan)), "number_out_of_range");
  EXPECT_EQ(fault_of(overwritten(file, "radii", zero)), "number_out_of_range");
  EXPECT_EQ(fault_of(overwritten(file, "radii", nan)), "number_out_of_range");
  EXPECT_EQ(fault_of(overwritten(file, "coefficients", nan)), "number_out_of_range");
}

}  // namespace
}  // namespace kiln
