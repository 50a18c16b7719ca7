#include "server/blobs/blob_store.h"

#include <fstream>

#include "tests/server/blobs/blob_fixture.h"

namespace kiln::testing {
namespace {

StoredBlob put(BlobStore& store, const std::string& text) {
  auto writer = store.write().value();
  EXPECT_TRUE(writer.write(bytes_of(text)));
  return writer.finish().value();
}

TEST_F(BlobTest, ABlobIsNamedByItsHashAndReadsBackInPieces) {
  const auto store = BlobStore::open(folder_).value();
  const StoredBlob blob = put(*store, "hello blob");
  EXPECT_EQ(blob.sha256, sha256_hex(bytes_of("hello blob")));
  EXPECT_EQ(blob.bytes, 10U);
  EXPECT_FALSE(blob.existed);
  EXPECT_TRUE(put(*store, "hello blob").existed);
  EXPECT_EQ(read(*store, blob.sha256), "hello blob");
  std::string piece(4, ' ');
  const auto reader = store->open_blob(blob.sha256).value();
  EXPECT_EQ(reader.read(8, {reinterpret_cast<std::uint8_t*>(piece.data()), 4}).value(), 2U);
  EXPECT_EQ(piece.substr(0, 2), "ob");
}

TEST_F(BlobTest, AWriterThatIsDroppedLeavesNothing) {
  const auto store = BlobStore::open(folder_).value();
  {
    auto writer = store->write().value();
    EXPECT_TRUE(writer.write(bytes_of("half")));
    EXPECT_EQ(files_in(folder_ / "tmp"), 1U);
  }
  EXPECT_EQ(files_in(folder_ / "tmp"), 0U);
}

TEST_F(BlobTest, ANamedUploadGoesOnWhereItStopped) {
  const auto store = BlobStore::open(folder_).value();
  const std::string text = "first half, second half";
  const std::string sha256 = sha256_hex(bytes_of(text));
  {
    auto writer = store->write_named(sha256).value();
    EXPECT_TRUE(writer.write(bytes_of(text.substr(0, 11))));
  }
  EXPECT_EQ(store->partial_bytes(sha256), 11U);
  EXPECT_EQ(store->write_named(sha256, 5).error().code, "offset_mismatch");
  auto writer = store->write_named(sha256, 11).value();
  EXPECT_EQ(writer.bytes(), 11U);
  EXPECT_TRUE(writer.write(bytes_of(text.substr(11))));
  EXPECT_EQ(writer.finish()->bytes, text.size());
  EXPECT_EQ(read(*store, sha256), text);
  EXPECT_EQ(files_in(folder_ / "tmp"), 0U);
}

TEST_F(BlobTest, BytesThatDoNotHashToTheirNameAreRefusedAndGone) {
  const auto store = BlobStore::open(folder_).value();
  const std::string sha256(64, 'a');
  auto writer = store->write_named(sha256).value();
  EXPECT_TRUE(writer.write(bytes_of("other bytes")));
  EXPECT_EQ(writer.finish().error().code, "hash_mismatch");
  EXPECT_FALSE(store->exists(sha256));
  EXPECT_EQ(store->partial_bytes(sha256), 0U);
}

TEST_F(BlobTest, OneUploadOfANameAtATime) {
  const auto store = BlobStore::open(folder_).value();
  const std::string sha256(64, 'a');
  {
    const auto first = store->write_named(sha256).value();
    EXPECT_EQ(store->write_named(sha256).error().code, "upload_busy");
  }
  EXPECT_TRUE(store->write_named(sha256));
}

TEST_F(BlobTest, NamesThatAreNoHashFindNothing) {
  const auto store = BlobStore::open(folder_).value();
  for (const std::string& name : {std::string("../../etc/passwd"), std::string(64, 'A'), std::string(63, 'a')}) {
    EXPECT_EQ(store->open_blob(name).error().code, "not_found");
    EXPECT_FALSE(store->exists(name));
    EXPECT_EQ(store->write_named(name).error().code, "hash_mismatch");
    EXPECT_EQ(store->partial_bytes(name), 0U);
  }
}

Result<StoredBlob> adopt(BlobStore& store, const std::filesystem::path& file) {
  auto stored = store.adopt({&file, 1});
  if (!stored) return tl::make_unexpected(stored.error());
  return stored->front();
}

TEST_F(BlobTest, AnAdoptedFileMovesInAndLinksAreNotFollowed) {
  const auto store = BlobStore::open(folder_).value();
  std::ofstream(folder_ / "result") << "result bytes";
  const StoredBlob blob = adopt(*store, folder_ / "result").value();
  EXPECT_EQ(read(*store, blob.sha256), "result bytes");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "result"));
  std::filesystem::create_symlink("/etc/passwd", folder_ / "link");
  EXPECT_EQ(adopt(*store, folder_ / "link").error().code, "not_found");
  EXPECT_EQ(adopt(*store, folder_ / "tmp").error().code, "not_found");
  EXPECT_EQ(adopt(*store, folder_ / "missing").error().code, "not_found");
}

TEST_F(BlobTest, AnOpenBlobOutlivesItsRemoval) {
  const auto store = BlobStore::open(folder_).value();
  const StoredBlob blob = put(*store, "kept open");
  const auto reader = store->open_blob(blob.sha256).value();
  EXPECT_TRUE(store->remove(blob.sha256));
  EXPECT_FALSE(store->exists(blob.sha256));
  std::string text(9, ' ');
  EXPECT_EQ(reader.read(0, {reinterpret_cast<std::uint8_t*>(text.data()), 9}).value(), 9U);
  EXPECT_EQ(text, "kept open");
  EXPECT_TRUE(store->remove(blob.sha256)) << "removing twice is fine";
}

TEST_F(BlobTest, PartsThatNobodyGoesOnWithExpireAndLivingOnesStay) {
  const auto store = BlobStore::open(folder_).value();
  store->write_named(std::string(64, 'a')).value();
  const auto living = store->write_named(std::string(64, 'b')).value();
  EXPECT_EQ(store->expire_partials(3600), 0);
  EXPECT_EQ(store->expire_partials(0), 1);
  EXPECT_EQ(files_in(folder_ / "tmp"), 1U);
}

}  // namespace
}  // namespace kiln::testing
