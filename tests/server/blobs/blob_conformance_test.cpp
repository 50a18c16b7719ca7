#include "tests/server/blobs/blob_conformance.h"

#include <fstream>
#include <map>
#include <thread>

namespace kiln::testing {
namespace {

/// Bytes that do not repeat within a piece.
std::string long_text(std::size_t size) {
  std::string text;
  for (std::size_t i = 0; text.size() < size; ++i) text += std::to_string(i * 7919) + ",";
  text.resize(size);
  return text;
}

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST_P(BlobConformance, ABlobIsNamedByItsHashAndReadsBackInPieces) {
  const StoredBlob blob = put(store(), "hello blob");
  EXPECT_EQ(blob.sha256, sha256_hex(bytes_of("hello blob")));
  EXPECT_EQ(blob.bytes, 10U);
  EXPECT_FALSE(blob.existed);
  EXPECT_TRUE(put(store(), "hello blob").existed);
  EXPECT_EQ(read(store(), blob.sha256), "hello blob");
  std::string piece(4, ' ');
  const auto reader = store().open_blob(blob.sha256).value();
  const std::span<std::uint8_t> out(reinterpret_cast<std::uint8_t*>(piece.data()), 4);
  EXPECT_EQ(reader.read(8, out).value(), 2U);
  EXPECT_EQ(piece.substr(0, 2), "ob");
  EXPECT_EQ(reader.read(3, out).value(), 4U);
  EXPECT_EQ(piece, "lo b");
  EXPECT_EQ(reader.read(10, out).value(), 0U);
  EXPECT_EQ(spooled(), 0U);
}

TEST_P(BlobConformance, ABlobOfManyPiecesComesBackAsItWas) {
  const std::string text = long_text(3'000'001);
  const StoredBlob blob = put(store(), text);
  const auto reader = store().open_blob(blob.sha256).value();
  ASSERT_EQ(reader.size(), text.size());
  std::string back(text.size(), ' ');
  auto* bytes = reinterpret_cast<std::uint8_t*>(back.data());
  for (std::size_t at = 0; at < back.size(); at += 1 << 20) {
    const std::size_t want = std::min<std::size_t>(1 << 20, back.size() - at);
    ASSERT_EQ(reader.read(at, {bytes + at, want}).value(), want);
  }
  EXPECT_TRUE(back == text);
  EXPECT_TRUE(store().place(blob.sha256, folder_ / "input"));
  EXPECT_TRUE(text_of(folder_ / "input") == text);
}

TEST_P(BlobConformance, AnEmptyBlobIsABlob) {
  const StoredBlob blob = put(store(), "");
  EXPECT_EQ(store().open_blob(blob.sha256)->size(), 0U);
  EXPECT_TRUE(store().place(blob.sha256, folder_ / "input"));
  EXPECT_EQ(text_of(folder_ / "input"), "");
}

TEST_P(BlobConformance, AWriterThatIsDroppedLeavesNothing) {
  {
    auto writer = store().write().value();
    EXPECT_TRUE(writer.write(bytes_of("half")));
    EXPECT_EQ(spooled(), 1U);
  }
  EXPECT_EQ(spooled(), 0U);
}

TEST_P(BlobConformance, ANamedUploadGoesOnWhereItStopped) {
  const std::string text = "first half, second half";
  const std::string sha256 = sha256_hex(bytes_of(text));
  {
    auto writer = store().write_named(sha256).value();
    EXPECT_TRUE(writer.write(bytes_of(text.substr(0, 11))));
  }
  EXPECT_EQ(store().partial_bytes(sha256), 11U);
  EXPECT_EQ(store().write_named(sha256, 5).error().code, "offset_mismatch");
  auto writer = store().write_named(sha256, 11).value();
  EXPECT_EQ(writer.bytes(), 11U);
  EXPECT_TRUE(writer.write(bytes_of(text.substr(11))));
  EXPECT_EQ(writer.finish()->bytes, text.size());
  EXPECT_EQ(read(store(), sha256), text);
  EXPECT_EQ(spooled(), 0U);
}

TEST_P(BlobConformance, ANamedUploadThatStartsAnewForgetsItsOldPart) {
  const std::string sha256 = sha256_hex(bytes_of("right"));
  { EXPECT_TRUE(store().write_named(sha256)->write(bytes_of("wrong bytes, and more of them"))); }
  auto writer = store().write_named(sha256).value();
  EXPECT_TRUE(writer.write(bytes_of("right")));
  EXPECT_EQ(writer.finish()->bytes, 5U);
  EXPECT_EQ(read(store(), sha256), "right");
}

TEST_P(BlobConformance, BytesThatDoNotHashToTheirNameAreRefusedAndGone) {
  const std::string sha256(64, 'a');
  auto writer = store().write_named(sha256).value();
  EXPECT_TRUE(writer.write(bytes_of("other bytes")));
  EXPECT_EQ(writer.finish().error().code, "hash_mismatch");
  EXPECT_FALSE(store().exists(sha256));
  EXPECT_EQ(store().partial_bytes(sha256), 0U);
}

TEST_P(BlobConformance, OneUploadOfANameAtATime) {
  const std::string sha256(64, 'a');
  {
    const auto first = store().write_named(sha256).value();
    EXPECT_EQ(store().write_named(sha256).error().code, "upload_busy");
    EXPECT_EQ(store().write_named(sha256, 1).error().code, "upload_busy");
  }
  EXPECT_TRUE(store().write_named(sha256));
}

TEST_P(BlobConformance, NobodyGoesOnWithTheBytesOfAnotherTenant) {
  const std::string text = "a scene that ends in zeros 0000";
  const std::string sha256 = sha256_hex(bytes_of(text));
  const std::size_t most = text.size() - 4;
  { EXPECT_TRUE(store().write_named(sha256, 0, "a")->write(bytes_of(text.substr(0, most)))); }
  EXPECT_EQ(store().partial_bytes(sha256, "b"), 0U);
  EXPECT_EQ(store().write_named(sha256, most, "b").error().code, "offset_mismatch");
  EXPECT_EQ(store().write_named(sha256, most).error().code, "offset_mismatch");
  EXPECT_EQ(store().partial_bytes(sha256, "a"), most);
  auto writer = store().write_named(sha256, most, "a").value();
  EXPECT_TRUE(writer.write(bytes_of(text.substr(most))));
  EXPECT_TRUE(writer.finish());
}

TEST_P(BlobConformance, NamesThatAreNoHashFindNothing) {
  for (const std::string& name : {std::string("../../etc/passwd"), std::string(64, 'A'), std::string(63, 'a')}) {
    EXPECT_EQ(store().open_blob(name).error().code, "not_found");
    EXPECT_EQ(store().place(name, folder_ / "input").error().code, "not_found");
    EXPECT_FALSE(store().exists(name));
    EXPECT_EQ(store().write_named(name).error().code, "hash_mismatch");
    EXPECT_EQ(store().partial_bytes(name), 0U);
    EXPECT_TRUE(store().remove(name));
  }
}

TEST_P(BlobConformance, WhatIsNotThereIsNotFound) {
  const std::string sha256(64, 'b');
  EXPECT_EQ(store().open_blob(sha256).error().code, "not_found");
  EXPECT_EQ(store().place(sha256, folder_ / "input").error().code, "not_found");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "input"));
}

TEST_P(BlobConformance, ResultsMoveInInTheirOrderAndLinksAreNotFollowed) {
  std::ofstream(folder_ / "one") << "result bytes";
  std::ofstream(folder_ / "two") << "others";
  const auto blobs = store().adopt(std::vector{folder_ / "one", folder_ / "two"}).value();
  EXPECT_EQ(read(store(), blobs[0].sha256), "result bytes");
  EXPECT_EQ(read(store(), blobs[1].sha256), "others");
  EXPECT_EQ(blobs[1].bytes, 6U);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "one"));
  std::filesystem::create_symlink("/etc/passwd", folder_ / "link");
  for (const char* name : {"link", "place", "missing"}) {
    EXPECT_EQ(store().adopt(std::vector{folder_ / name}).error().code, "not_found") << name;
  }
}

TEST_P(BlobConformance, ARemovedBlobIsGoneAndMayComeAgain) {
  const StoredBlob blob = put(store(), "comes and goes");
  EXPECT_TRUE(store().remove(blob.sha256));
  EXPECT_FALSE(store().exists(blob.sha256));
  EXPECT_TRUE(store().remove(blob.sha256)) << "removing twice is fine";
  put(store(), "comes and goes");
  EXPECT_EQ(read(store(), blob.sha256), "comes and goes");
}

TEST_P(BlobConformance, TheListNamesEveryBlobWithItsSize) {
  std::map<std::string, std::uint64_t> stored, listed;
  for (std::size_t i = 0; i < 8; ++i) {
    const StoredBlob blob = put(store(), long_text(i * 10));
    stored[blob.sha256] = blob.bytes;
  }
  const auto unfinished = store().write_named(std::string(64, 'c'));
  EXPECT_TRUE(store().for_each([&](const BlobEntry& blob) {
    listed[blob.sha256] = blob.bytes;
    EXPECT_GT(blob.age_s, -3600) << "clocks of two machines";
  }));
  EXPECT_EQ(listed, stored);
}

TEST_P(BlobConformance, TwoProgramsSeeEachOthersBlobsAndStoreTheSameOneAtOnce) {
  const auto other = open();
  const StoredBlob blob = put(store(), "from the first");
  EXPECT_EQ(read(*other, blob.sha256), "from the first");
  const std::string text = long_text(200'000);
  std::vector<std::thread> writers;
  for (int i = 0; i < 4; ++i) writers.emplace_back([&, i] { put(i % 2 == 0 ? store() : *other, text); });
  for (std::thread& writer : writers) writer.join();
  EXPECT_TRUE(read(*other, sha256_hex(bytes_of(text))) == text);
  EXPECT_TRUE(other->remove(blob.sha256));
  EXPECT_FALSE(store().exists(blob.sha256));
}

TEST_P(BlobConformance, FilesOfTheSpoolGoWhenTheirWriterIsGoneAndNotBefore) {
  const auto other = open();
  const auto living = store().write().value();
  const auto named = store().write_named(std::string(64, 'b')).value();
  { const auto left = store().write_named(std::string(64, 'a')).value(); }
  EXPECT_EQ(other->remove_dead_writers(), 0);
  EXPECT_EQ(other->expire_partials(3600), 0);
  EXPECT_EQ(other->expire_partials(0), 1);
  EXPECT_EQ(spooled(), 2U);
}

TEST_P(BlobConformance, ItBelongsToWhoeverClaimedItFirst) {
  const std::string first(32, '1'), second(32, '2');
  EXPECT_EQ(store().owner(first).value(), first);
  EXPECT_EQ(open()->owner(second).value(), first);
  EXPECT_EQ(store().owner(first).value(), first);
  EXPECT_TRUE(store().for_each([](const BlobEntry& blob) { ADD_FAILURE() << blob.sha256 << " is no blob"; }));
}

TEST_P(BlobConformance, ItIsReady) { EXPECT_TRUE(store().check()); }

}  // namespace
}  // namespace kiln::testing
