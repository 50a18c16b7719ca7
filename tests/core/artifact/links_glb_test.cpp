// KILN_meshless_light: what is written comes back, and whatever bytes come end in links or a typed fault.

#include "core/artifact/links_glb.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "core/artifact/glb.h"
#include "core/base/random.h"
#include "tests/core/artifact/random_baked.h"

namespace kiln {
namespace {

/// Random links that are valid for so many vertices.
LightLinks random_links(std::size_t vertices) {
  Random random(7, 0);
  const auto below = [&](std::uint32_t n) { return static_cast<std::uint32_t>(random.next() % n); };
  LightLinks l{.senders = 20, .sweeps = 5, .tail = 0.75F};
  l.sample_begin = {0};
  for (std::uint32_t s = 0; s < l.senders; ++s) {
    for (std::uint32_t k = 0; k <= below(10); ++k) l.samples.push_back({{random.uniform(), 0, -0.5F}, {0, 127, 0}});
    l.sample_begin.push_back(static_cast<std::uint32_t>(l.samples.size()));
  }
  l.child_begin = {0};
  for (std::uint32_t i = 0; i < 6; ++i) {
    for (int k = 0; k < 4; ++k) {
      l.children.push_back(
          {static_cast<std::uint16_t>(below(l.senders + i)), static_cast<std::uint16_t>(1 + below(65535))});
    }
    l.child_begin.push_back(static_cast<std::uint32_t>(l.children.size()));
  }
  l.link_begin = {0};
  for (int row = 0; row < 50; ++row) {
    l.sites.push_back({{0.1F, 0.2F, random.uniform()}, {1, 2, 3}, 2});
    l.scale.push_back(random.uniform());
    for (std::uint32_t k = 0; k < below(30); ++k) {
      const auto byte = [&] { return static_cast<std::uint8_t>(below(256)); };
      const auto step = [&] { return static_cast<std::int8_t>(static_cast<int>(below(255)) - 127); };
      l.links.push_back({static_cast<std::uint16_t>(below(26)), {byte(), byte(), byte()}, {step(), step(), step()}});
    }
    l.link_begin.push_back(static_cast<std::uint32_t>(l.links.size()));
  }
  l.term_begin = {0};
  for (std::size_t v = 0; v < vertices; ++v) {
    for (std::uint32_t k = 0; k < below(4); ++k) l.terms.push_back({below(50), static_cast<std::uint8_t>(below(256))});
    l.term_begin.push_back(static_cast<std::uint32_t>(l.terms.size()));
  }
  return l;
}

struct Sample {
  BakedScene baked;
  LightLinks links;
  Bytes plain, file;
};

const Sample& sample() {
  static const Sample made = [] {
    Sample out;
    out.plain = *write_baked_glb(random_baked({.order = 2, .fixed = true, .side = 4}));
    out.baked = *read_baked_glb(out.plain);
    out.links = random_links(out.baked.scene.mesh.position.size());
    out.file = *add_links(out.plain, out.links);
    return out;
  }();
  return made;
}

std::string code_of(const Bytes& file) {
  const auto read = read_links(file, sample().baked);
  return read ? "" : read.error().code;
}

/// The file of other links.
template <class Change>
Bytes changed(const Change& change) {
  LightLinks links = sample().links;
  change(links);
  return *add_links(sample().plain, links);
}

Bytes with_header(const char* member, const nlohmann::json& value) {
  const auto chunks = split_glb(sample().file);
  nlohmann::json json = nlohmann::json::parse(chunks->json);
  json["extensions"]["KILN_meshless_light"][member] = value;
  return *join_glb(json.dump(), Bytes(chunks->binary.begin(), chunks->binary.end()));
}

TEST(LinksGlb, ComeBackBitForBit) {
  const auto read = read_links(sample().file, sample().baked);
  ASSERT_TRUE(read) << read.error().message;
  const LightLinks &a = sample().links, &b = *read;
  EXPECT_EQ(a.senders, b.senders);
  EXPECT_EQ(a.sweeps, b.sweeps);
  EXPECT_EQ(a.tail, b.tail);
  EXPECT_EQ(a.sample_begin, b.sample_begin);
  EXPECT_EQ(a.child_begin, b.child_begin);
  EXPECT_EQ(a.scale, b.scale);
  EXPECT_EQ(a.link_begin, b.link_begin);
  EXPECT_EQ(a.links, b.links);
  EXPECT_EQ(a.term_begin, b.term_begin);
  const auto same = [](const auto& x, const auto& y) {
    return x.size() == y.size() && std::memcmp(x.data(), y.data(), x.size() * sizeof(x[0])) == 0;
  };
  EXPECT_TRUE(same(a.samples, b.samples) && same(a.children, b.children) && same(a.sites, b.sites));
  ASSERT_EQ(a.terms.size(), b.terms.size());
  for (std::size_t i = 0; i < a.terms.size(); ++i) {
    EXPECT_EQ(a.terms[i].row, b.terms[i].row);
    EXPECT_EQ(a.terms[i].weight, b.terms[i].weight);
  }
}

TEST(LinksGlb, LeaveTheBakedSceneAsItWas) {
  const auto read = read_baked_glb(sample().file);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->scene.mesh.position, sample().baked.scene.mesh.position);
  EXPECT_EQ(read->transfer.coefficients, sample().baked.transfer.coefficients);
  const auto none = read_links(sample().plain, sample().baked);
  ASSERT_TRUE(none);
  EXPECT_EQ(none->vertices(), 0U);
}

TEST(LinksGlb, WhatDoesNotFitTogetherIsNamed) {
  EXPECT_EQ(code_of(changed([](LightLinks& l) { l.links[3].node = 26; })), "index_out_of_range");
  EXPECT_EQ(code_of(changed([](LightLinks& l) { l.terms[0].row = 50; })), "index_out_of_range");
  EXPECT_EQ(code_of(changed([](LightLinks& l) { l.children[0].node = 20; })), "index_out_of_range");
  EXPECT_EQ(code_of(changed([](LightLinks& l) { l.children[0].share = 0; })), "index_out_of_range");
  EXPECT_EQ(code_of(changed([](LightLinks& l) { l.link_begin[1] = 0xffffffffU; })), "index_out_of_range");
  EXPECT_EQ(code_of(changed([](LightLinks& l) { l.scale[0] = NAN; })), "number_out_of_range");
  EXPECT_EQ(code_of(changed([](LightLinks& l) { l.scale[0] = -1; })), "number_out_of_range");
  EXPECT_EQ(code_of(changed([](LightLinks& l) { l.samples[0].position.x = INFINITY; })), "number_out_of_range");
  EXPECT_EQ(code_of(changed([](LightLinks& l) { l.sites[0].position.y = 1e30F; })), "number_out_of_range");
  EXPECT_EQ(code_of(changed([](LightLinks& l) { l.sites.pop_back(); })), "slot_count_mismatch");
  EXPECT_EQ(code_of(changed([](LightLinks& l) { l.term_begin.pop_back(); })), "slot_count_mismatch");
  EXPECT_EQ(code_of(changed([](LightLinks& l) { l.senders = 21; })), "slot_count_mismatch");
  EXPECT_EQ(code_of(with_header("version", 3)), "unsupported_version");
  EXPECT_EQ(code_of(with_header("senders", "many")), "json_type");
  EXPECT_EQ(code_of(with_header("nodes", 70000)), "number_out_of_range");
  EXPECT_EQ(code_of(with_header("sweeps", 1e9)), "number_out_of_range");
  EXPECT_EQ(code_of(with_header("tail", -1)), "number_out_of_range");
  EXPECT_EQ(code_of(with_header("bufferViews", {{"links", 4000}})), "index_out_of_range");
  EXPECT_EQ(code_of(with_header("bufferViews", nlohmann::json::array())), "json_type");
}

TEST(LinksGlb, DamagedFilesNeverCrashAndWhatReadsIsInRange) {
  Random random(11, 0);
  int good = 0;
  for (int i = 0; i < 400; ++i) {
    Bytes file = sample().file;
    if (i % 4 == 0) file.resize(random.next() % file.size());
    for (int k = 0; k < 1 + i % 8 && !file.empty(); ++k)
      file[random.next() % file.size()] = static_cast<std::uint8_t>(random.next());
    const auto read = read_links(file, sample().baked);
    if (!read) {
      EXPECT_FALSE(read.error().code.empty());
      continue;
    }
    ++good;
    for (const LightLink& link : read->links) ASSERT_LT(link.node, std::max<std::size_t>(1, read->nodes()));
    for (const RowTerm& t : read->terms) ASSERT_LT(t.row, read->rows());
    const std::vector<Vec3f> dark(read->senders);
    (void)solve_nodes(*read, dark);
  }
  EXPECT_GT(good, 10);  // 32 were: most bytes of arrays are numbers of which any is valid
}

}  // namespace
}  // namespace kiln
