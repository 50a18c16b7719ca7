#include "core/lightfield/progressive_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <iterator>

#include "core/base/sha256.h"
#include "tests/core/lightfield/lit_models.h"

namespace kiln {
namespace {

using testing::expect_sound;

/// Hills with a seam of uvs and parts along x = 0, a colour for every place, and light of degree 2.
LitMesh sample(std::uint32_t n) {
  LitMesh lit = testing::sheet(
      n, testing::hills,
      [](const Vec3f& p) {
        return Vec3f{1 + p.x, 1 + std::sin(9 * p.y), 0.5F};
      },
      2);
  for (std::size_t v = 0; v < lit.mesh.position.size(); ++v) {
    const Vec3f p = lit.mesh.position[v];
    lit.mesh.uv0.push_back({p.x, p.y});
    lit.mesh.tangent.push_back({1, 0, 0, 1});
    for (std::size_t i = 1; i < 9; ++i) lit.field.of(v)[i] = 0.2F * std::sin(static_cast<float>(i) * (p.x + 2 * p.y));
  }
  std::map<std::uint32_t, std::uint32_t> twin;
  for (std::size_t t = 0; t < lit.mesh.triangles.size(); ++t) {
    float x = 0;
    for (const std::uint32_t v : lit.mesh.triangles[t]) x += lit.mesh.position[v].x;
    if (x < 0) continue;
    lit.mesh.part[t] = 1;
    for (std::uint32_t& v : lit.mesh.triangles[t]) {
      if (std::abs(lit.mesh.position[v].x) > 1e-6F) continue;
      if (!twin.contains(v)) {
        twin[v] = append_vertex(lit, lit, v);
        lit.mesh.uv0.back().x += 3;
      }
      v = twin[v];
    }
  }
  return lit;
}

SimplifyResult recorded(const LitMesh& lit, Collapse how, std::size_t triangles = 60) {
  Threads threads(2);
  return simplify(lit, {.triangles = triangles, .collapse = how, .record = true}, threads);
}

/// Triangles as their corners' attributes, in an order of their own: equal for equal meshes however they are numbered.
std::vector<std::vector<float>> soup(const LitMesh& lit) {
  std::vector<std::vector<float>> out;
  for (std::size_t t = 0; t < lit.mesh.triangles.size(); ++t) {
    std::array<std::vector<float>, 3> corner;
    for (std::size_t c = 0; c < 3; ++c) {
      const std::uint32_t v = lit.mesh.triangles[t][c];
      each_attribute(lit.mesh, [&](const auto& array) {
        const auto* first = reinterpret_cast<const float*>(&array[v]);
        corner[c].insert(corner[c].end(), first, first + sizeof array[v] / sizeof(float));
      });
      const auto rf = lit.field.of(v);
      corner[c].insert(corner[c].end(), rf.begin(), rf.end());
    }
    std::ranges::rotate(corner, std::ranges::min_element(corner));
    std::vector<float>& all = out.emplace_back();
    for (const auto& c : corner) all.insert(all.end(), c.begin(), c.end());
    all.push_back(static_cast<float>(lit.mesh.part[t]));
  }
  std::ranges::sort(out);
  return out;
}

class Progressive : public ::testing::TestWithParam<Collapse> {};
INSTANTIATE_TEST_SUITE_P(ProgressiveMesh, Progressive, ::testing::Values(Collapse::edge, Collapse::half_edge));

TEST_P(Progressive, ItsEndsAreTheSimplifiedMeshAndTheInput) {
  const LitMesh lit = sample(16);
  const SimplifyResult result = recorded(lit, GetParam());
  const ProgressiveMesh p = progressive_mesh(result.record);
  EXPECT_GT(p.levels(), 100U);
  EXPECT_TRUE(std::ranges::any_of(p.splits, [](const VertexSplit& s) { return s.vertices == 2; }));  // of the seam
  EXPECT_EQ(soup(at_level(p, 0)), soup(result.lit));
  EXPECT_EQ(soup(at_level(p, p.levels() - 1)), soup(lit));
  EXPECT_FLOAT_EQ(level_error(p, 0), static_cast<float>(result.error));
  EXPECT_EQ(level_error(p, p.levels() - 1), 0);
}

TEST_P(Progressive, EveryLevelIsWhatSimplifyGivesForItsNumberOfTriangles) {
  const LitMesh lit = sample(10);
  const ProgressiveMesh p = progressive_mesh(recorded(lit, GetParam(), 20).record);
  for (std::size_t level = 0; level < p.levels(); level += 7) {
    const LitMesh here = at_level(p, level);
    expect_sound(here);
    EXPECT_EQ(soup(here), soup(recorded(lit, GetParam(), here.mesh.triangles.size()).lit));
    EXPECT_EQ(level_of_triangles(p, here.mesh.triangles.size()), level);
    EXPECT_EQ(level_of_triangles(p, here.mesh.triangles.size() + 1) >= level, true);
  }
  EXPECT_EQ(level_of_triangles(p, 0), 0U);
}

TEST_P(Progressive, FlatShadedMeshesComeBackToo) {
  const LitMesh lit = testing::flat_shaded(sample(8));
  const SimplifyResult result = recorded(lit, GetParam());
  const ProgressiveMesh p = progressive_mesh(result.record);
  EXPECT_EQ(soup(at_level(p, 0)), soup(result.lit));
  EXPECT_EQ(soup(at_level(p, p.levels() - 1)), soup(lit));
  const auto back = decode_progressive(encode_progressive(p));
  ASSERT_TRUE(back);
  EXPECT_EQ(soup(at_level(*back, p.levels() / 2)), soup(at_level(p, p.levels() / 2)));
}

TEST_P(Progressive, ErrorsFallFromLevelToLevel) {
  const ProgressiveMesh p = progressive_mesh(recorded(sample(16), GetParam()).record);
  for (std::size_t level = 1; level < p.levels(); ++level) EXPECT_LE(level_error(p, level), level_error(p, level - 1));
}

TEST_P(Progressive, BytesComeBackAsTheyWere) {
  const ProgressiveMesh p = progressive_mesh(recorded(sample(12), GetParam()).record);
  const auto bytes = encode_progressive(p);
  const auto back = decode_progressive(bytes);
  ASSERT_TRUE(back);
  EXPECT_EQ(encode_progressive(*back), bytes);
  EXPECT_EQ(soup(at_level(*back, p.levels() / 2)), soup(at_level(p, p.levels() / 2)));
}

TEST_P(Progressive, WhatIsSeenOfLampsComesBackToo) {
  LitMesh lit = sample(12);
  lit.field.lamps.resize(3);
  for (std::size_t v = 0; v < lit.mesh.position.size(); ++v)
    for (int k = 0; k < 3; ++k)
      lit.field.lamp_visibility.push_back(0.5F + 0.5F * std::sin(static_cast<float>(k + 5) * lit.mesh.position[v].y));
  const ProgressiveMesh p = progressive_mesh(recorded(lit, GetParam()).record);
  const auto back = decode_progressive(encode_progressive(p));
  ASSERT_TRUE(back);
  ASSERT_EQ(back->all.field.lamps.size(), 3U);
  EXPECT_EQ(back->all.field.lamp_visibility, p.all.field.lamp_visibility);
  const LitMesh finest = at_level(*back, p.levels() - 1);
  ASSERT_EQ(finest.field.lamp_visibility.size(), 3 * finest.mesh.position.size());
  for (std::size_t v = 0; v < finest.mesh.position.size(); ++v)  // each with its own vertex
    EXPECT_FLOAT_EQ(finest.field.lamp_visibility[3 * v], 0.5F + 0.5F * std::sin(5 * finest.mesh.position[v].y));
}

TEST_P(Progressive, DiffuseLightComesBackBesideLamps) {
  LitMesh lit = sample(12);
  lit.field.lamps.resize(8);
  lit.field.lamp_visibility.assign(8 * lit.mesh.position.size(), 0.5F);
  for (const Vec3f& p : lit.mesh.position) lit.field.diffuse.insert(lit.field.diffuse.end(), {p.x, p.y, p.z});
  lit.field.diffuse_color = {0.5F, 0.5F, 0.5F};
  const ProgressiveMesh p = progressive_mesh(recorded(lit, GetParam()).record);
  const auto back = decode_progressive(encode_progressive(p));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->all.field.lamps.size(), 8U);
  const LitMesh finest = at_level(*back, p.levels() - 1);
  ASSERT_EQ(finest.field.diffuse.size(), 3 * finest.mesh.position.size());
  for (std::size_t v = 0; v < finest.mesh.position.size(); ++v)  // each with its own vertex
    EXPECT_EQ(finest.field.diffuse[3 * v + 1], finest.mesh.position[v].y);
}

TEST(ProgressiveMesh, MoreLampsThanThereMayBeAreAFault) {
  auto bytes = encode_progressive(progressive_mesh(recorded(sample(4), Collapse::edge, 10).record));
  // Of the attributes bits 6 and 9: nine lamps; bit 11: nobody knows.
  bytes[8] |= 64;
  bytes[9] |= 2 + 8;
  const auto out = decode_progressive(bytes);
  ASSERT_FALSE(out);
  EXPECT_EQ(out.error().code, "unsupported_version");
}

TEST(ProgressiveMesh, WithoutACollapseItIsTheInput) {
  const LitMesh lit = sample(4);
  const ProgressiveMesh p = progressive_mesh(recorded(lit, Collapse::edge, 1000).record);
  EXPECT_EQ(p.levels(), 1U);
  EXPECT_EQ(soup(at_level(p, 0)), soup(lit));
  ASSERT_TRUE(decode_progressive(encode_progressive(p)));
}

TEST(ProgressiveMesh, EveryTruncationIsAFault) {
  const auto bytes = encode_progressive(progressive_mesh(recorded(sample(4), Collapse::edge, 10).record));
  for (std::size_t size = 0; size < bytes.size(); size += 1 + size / 50) {
    const auto out = decode_progressive(std::span(bytes).first(size));
    ASSERT_FALSE(out);
    EXPECT_EQ(out.error().code, "truncated");
  }
}

TEST(ProgressiveMesh, FaultsNameTheirPlace) {
  const ProgressiveMesh good = progressive_mesh(recorded(sample(6), Collapse::edge, 20).record);
  const auto fault_of = [&](auto spoil) {
    ProgressiveMesh bad = good;
    spoil(bad);
    const auto out = decode_progressive(encode_progressive(bad));
    return out ? Fault{} : out.error();
  };
  const auto expect = [&](const char* code, const char* where, auto spoil) {
    const Fault f = fault_of(spoil);
    EXPECT_EQ(f.code, code);
    EXPECT_EQ(f.where.substr(0, std::strlen(where)), where);
  };
  expect("", "", [](ProgressiveMesh&) {});
  expect("index_out_of_range", "split 3", [](ProgressiveMesh& p) { p.splits[3].parent[0] = 1U << 30; });
  expect("index_out_of_range", "split", [](ProgressiveMesh& p) { p.turned[0] = 0xfffffff0U; });
  expect("index_out_of_range", "base triangle 2", [](ProgressiveMesh& p) { p.all.mesh.triangles[2] = {1, 1, 2}; });
  expect("index_out_of_range", "split", [](ProgressiveMesh& p) { p.all.mesh.triangles.back()[0] = 1U << 31; });
  expect("index_out_of_range", "split", [](ProgressiveMesh& p) { p.moved_vertex[0] = 1U << 30; });
  expect("slot_count_mismatch", "split 2", [](ProgressiveMesh& p) { p.splits[2].vertices = 0; });
  expect("slot_count_mismatch", "header", [](ProgressiveMesh& p) { p.splits.pop_back(); });
  expect("slot_count_mismatch", "header", [](ProgressiveMesh& p) { p.base_vertices = 1U << 31; });
  expect("number_out_of_range", "split 5", [](ProgressiveMesh& p) { p.splits[5].error = 1e9F; });
  expect("number_out_of_range", "split 0", [](ProgressiveMesh& p) { p.splits[0].error = NAN; });
  expect("number_out_of_range", "vertices", [](ProgressiveMesh& p) { p.all.field.coefficients[7] = INFINITY; });
  expect("number_out_of_range", "moved rows", [](ProgressiveMesh& p) { p.moved.mesh.position[0].x = NAN; });
}

TEST(ProgressiveMesh, NoByteOfAFileCanBreakTheReader) {
  const auto bytes = encode_progressive(progressive_mesh(recorded(sample(5), Collapse::edge, 12).record));
  int faults = 0;
  for (std::uint64_t i = 0; i < 5000; ++i) {
    Random random(11, i);
    auto spoilt = bytes;
    const auto times = 1 + random.next() % 3;
    for (std::uint64_t k = 0; k < times; ++k)
      spoilt[random.next() % (i % 2 ? 40 : spoilt.size())] = static_cast<std::uint8_t>(random.next());
    const auto out = decode_progressive(spoilt);
    faults += !out;
    if (out) at_level(*out, out->levels() - 1);  // what passes can be shown
  }
  EXPECT_GT(faults, 2500);  // all of the header's, but for the bytes that changed to themselves or mean nothing
}

std::string geometry_hash(const LitMesh& lit) {
  Sha256 hash;
  const auto put = [&](const auto& array) {
    const auto* first = reinterpret_cast<const std::uint8_t*>(array.data());
    hash.update({first, array.size() * sizeof array[0]});
  };
  each_attribute(lit.mesh, put);
  put(lit.field.coefficients), put(lit.mesh.triangles), put(lit.mesh.part);
  return hash.hex();
}

/// A mean and rows at right angles: the harmonics of both bands of red, green and blue, turned among each other.
std::vector<float> rows_for(const LightField& field, std::size_t rank) {
  const std::size_t stride = 3 * field.count();
  std::vector<float> rows((rank + 1) * stride);
  std::fill_n(rows.begin(), stride, 0.125F);
  for (std::size_t k = 0; k < rank; k += 2) {
    rows[(k + 1) * stride + k] = 0.6F, rows[(k + 1) * stride + k + 1] = 0.8F;
    if (k + 1 < rank) rows[(k + 2) * stride + k] = -0.8F, rows[(k + 2) * stride + k + 1] = 0.6F;
  }
  return rows;
}

TEST_P(Progressive, LightAsWeightsOfAllRowsIsRightToHalfAStepAndTheRestBitByBit) {
  const ProgressiveMesh p = progressive_mesh(recorded(sample(12), GetParam()).record);
  const std::size_t stride = 3 * p.all.field.count(), even = stride / 2 * 2;
  const auto bytes = encode_progressive(p, rows_for(p.all.field, even));
  const auto back = decode_progressive(bytes);
  ASSERT_TRUE(back) << back.error().message;
  const auto [low, high] = std::ranges::minmax(p.all.field.coefficients);
  // Weights of two numbers reach over sqrt(2) of their range; half a step of each moves a number by sqrt(2) / 2 of it.
  const float most = 1.01F * (high - low) / 65535;
  for (std::size_t v = 0; v < p.all.field.vertices(); ++v) {
    for (std::size_t s = 0; s < even; ++s) EXPECT_NEAR(back->all.field.of(v)[s], p.all.field.of(v)[s], most);
  }
  for (std::size_t v = 0; v < p.moved.field.vertices(); ++v) {
    for (std::size_t s = 0; s < even; ++s) EXPECT_NEAR(back->moved.field.of(v)[s], p.moved.field.of(v)[s], most);
  }
  ProgressiveMesh shape = *back;
  shape.all.field = p.all.field, shape.moved.field = p.moved.field;
  EXPECT_EQ(encode_progressive(shape), encode_progressive(p));
}

TEST(ProgressiveMesh, WeightsThatHaveFewStepsTakeEightBits) {
  const ProgressiveMesh p = progressive_mesh(recorded(sample(12), Collapse::edge).record);
  const std::vector<float> rows = rows_for(p.all.field, 8);
  const std::size_t vertices = p.all.mesh.position.size() + p.moved.mesh.position.size();
  const auto fine = encode_progressive(p, rows), coarse = encode_progressive(p, rows, 1);
  EXPECT_EQ(fine.size() - coarse.size(), 8 * vertices);  // no range is above 255, so none is wide
  const auto back = decode_progressive(coarse), exact = decode_progressive(fine);
  ASSERT_TRUE(back && exact);
  for (std::size_t i = 0; i < back->all.field.coefficients.size(); ++i)  // ranges of up to 3 in 255 steps, two of them
    EXPECT_NEAR(back->all.field.coefficients[i], exact->all.field.coefficients[i], 0.012F);
}

TEST(ProgressiveMesh, LightAsWeightsIsSmallerAndItsDamageIsAFault) {
  const ProgressiveMesh p = progressive_mesh(recorded(sample(6), Collapse::edge, 20).record);
  const auto bytes = encode_progressive(p, rows_for(p.all.field, 4), 0.01), plain = encode_progressive(p);
  EXPECT_LT(bytes.size(), plain.size());
  for (std::size_t size = 0; size < bytes.size(); size += 1 + size / 50)
    EXPECT_FALSE(decode_progressive(std::span(bytes).first(size)));
  int faults = 0;
  for (std::uint64_t i = 0; i < 2000; ++i) {
    Random random(13, i);
    auto spoilt = bytes;
    spoilt[random.next() % (i % 2 ? 80 : spoilt.size())] = static_cast<std::uint8_t>(random.next());
    const auto out = decode_progressive(spoilt);
    faults += !out;
    if (out) at_level(*out, out->levels() - 1);
  }
  EXPECT_GT(faults, 500);
}

/// tests/browser/progressive.test.mjs says the same of the same files: both decoders give the same bits.
/// KILN_WRITE_GOLDEN=1 writes them anew.
TEST(ProgressiveMesh, TheGoldenFilesHaveTheirLevels) {
  const ProgressiveMesh whole = progressive_mesh(recorded(sample(16), Collapse::edge).record);
  for (const auto& [name, rank] : {std::pair("progressive", 0U), std::pair("progressive_weights", 5U)}) {
    const std::string path = std::string(KILN_SOURCE "/tests/browser/fixtures/") + name;
    if (std::getenv("KILN_WRITE_GOLDEN") != nullptr) {
      const auto bytes =
          rank > 0 ? encode_progressive(whole, rows_for(whole.all.field, rank), 0.01) : encode_progressive(whole);
      std::ofstream(path + ".bin", std::ios::binary)
          .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
      const auto p = decode_progressive(bytes);
      ASSERT_TRUE(p);
      std::ofstream list(path + ".txt");
      for (std::size_t level = 0; level < p->levels(); level += 20) {
        const LitMesh lit = at_level(*p, level);
        list << level << ' ' << lit.mesh.position.size() << ' ' << lit.mesh.triangles.size() << ' '
             << geometry_hash(lit) << '\n';
      }
    }
    std::ifstream file(path + ".bin", std::ios::binary);
    const std::vector<std::uint8_t> bytes(std::istreambuf_iterator<char>(file), {});
    const auto p = decode_progressive(bytes);
    ASSERT_TRUE(p);
    std::ifstream list(path + ".txt");
    std::size_t level = 0, vertices = 0, triangles = 0, lines = 0;
    for (std::string hash; list >> level >> vertices >> triangles >> hash; ++lines) {
      const LitMesh lit = at_level(*p, level);
      EXPECT_EQ(lit.mesh.position.size(), vertices);
      EXPECT_EQ(lit.mesh.triangles.size(), triangles);
      EXPECT_EQ(geometry_hash(lit), hash);
    }
    EXPECT_GT(lines, 5U);
  }
}

}  // namespace
}  // namespace kiln
