// The conformance suite on an S3 store that verifies signatures: OpenStack Swift, started here.

#include <cstdio>

#include "server/blobs/s3_blobs.h"
#include "tests/fixtures/swift_server.h"
#include "tests/server/blobs/blob_conformance.h"

namespace kiln::testing {
namespace {

SwiftServer& swift() {
  static const std::unique_ptr<SwiftServer> one = std::make_unique<SwiftServer>();
  return *one;
}

S3Options options() {
  return {swift().endpoint(), SwiftServer::kBucket, "us-east-1", SwiftServer::kKey, SwiftServer::kSecret};
}

std::unique_ptr<BlobStore> open_swift(const std::filesystem::path& folder) {
  return open_s3_blobs(options(), folder).value();
}

void empty_bucket() {
  std::string name = (std::filesystem::temp_directory_path() / "kiln_empty.XXXXXX").string();
  const std::filesystem::path folder = ::mkdtemp(name.data());
  const auto store = open_swift(folder);
  std::vector<std::string> all;
  EXPECT_TRUE(store->for_each([&](const BlobEntry& blob) { all.push_back(blob.sha256); }));
  for (const std::string& sha256 : all) EXPECT_TRUE(store->remove(sha256));
  EXPECT_TRUE(swift().remove("owner"));
  std::filesystem::remove_all(folder);
}

}  // namespace

INSTANTIATE_TEST_SUITE_P(Swift, BlobConformance, ::testing::Values(BlobPlace{"swift", open_swift, empty_bucket}),
                         place_name);

namespace {

TEST_F(BlobTest, AWrongSecretAndAMissingBucketAreRefused) {
  S3Options wrong = options();
  wrong.secret = "guessed";
  EXPECT_EQ(open_s3_blobs(wrong, folder_).error().code, "blobs_refused");
  wrong = options();
  wrong.bucket = "elsewhere";
  EXPECT_EQ(open_s3_blobs(wrong, folder_).error().code, "blobs_refused");
}

TEST_F(BlobTest, BytesThatChangedInTheStoreAreNotHandedOn) {
  const auto store = open_swift(folder_);
  auto writer = store->write().value();
  EXPECT_TRUE(writer.write(bytes_of("right bytes")));
  const std::string sha256 = writer.finish()->sha256;
  ASSERT_TRUE(swift().overwrite(sha256.substr(0, 2) + "/" + sha256, "wrong bytes"));
  EXPECT_EQ(store->place(sha256, folder_ / "input").error().code, "blobs_unavailable");
}

}  // namespace
}  // namespace kiln::testing

int main(int argc, char** argv) {
  if (!kiln::testing::has_swift()) {
    std::puts("skipped: the packages swift-proxy, swift-object, swift-container, swift-account are not installed");
    return 77;
  }
  ::testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
