// The conformance suite on files and on the fake S3 store, and what only one of them promises.

#include <fstream>

#include "server/blobs/s3_blobs.h"
#include "tests/fixtures/fake_s3.h"
#include "tests/server/blobs/blob_conformance.h"

namespace kiln::testing {
namespace {

FakeS3& fake_s3() {
  static FakeS3 one;
  return one;
}

S3Options fake_options() {
  S3Options options{fake_s3().endpoint(), FakeS3::kBucket, "us-east-1", "key", "secret"};
  options.first_pause = std::chrono::milliseconds(1);
  options.stall_timeout = std::chrono::seconds(1);
  return options;
}

BlobPlace files() {
  return {"files", [](const std::filesystem::path& folder) { return open_file_blobs(folder).value(); }};
}
BlobPlace fake() {
  return {"fake_s3", [](const std::filesystem::path& folder) { return open_s3_blobs(fake_options(), folder).value(); },
          [] { fake_s3().clear(); }};
}

}  // namespace

INSTANTIATE_TEST_SUITE_P(Places, BlobConformance, ::testing::Values(files(), fake()), place_name);

namespace {

TEST_F(BlobTest, AnOpenFileOutlivesItsRemoval) {
  const auto store = open_file_blobs(folder_).value();
  auto writer = store->write().value();
  EXPECT_TRUE(writer.write(bytes_of("kept open")));
  const StoredBlob blob = writer.finish().value();
  const auto reader = store->open_blob(blob.sha256).value();
  EXPECT_TRUE(store->remove(blob.sha256));
  std::string text(9, ' ');
  EXPECT_EQ(reader.read(0, {reinterpret_cast<std::uint8_t*>(text.data()), 9}).value(), 9U);
  EXPECT_EQ(text, "kept open");
}

TEST_F(BlobTest, ResultsOfAnotherFileSystemAreCopiedIn) {
  const auto store = open_file_blobs(folder_).value();
  std::string name = (std::filesystem::temp_directory_path() / "kiln_result.XXXXXX").string();
  const int fd = ::mkstemp(name.data());
  ASSERT_EQ(::write(fd, "far away", 8), 8);
  ::close(fd);
  const auto blobs = store->adopt(std::vector<std::filesystem::path>{name}).value();
  EXPECT_EQ(read(*store, blobs[0].sha256), "far away");
  EXPECT_FALSE(std::filesystem::exists(name));
  EXPECT_EQ(files_in(folder_ / "tmp"), 0U);
}

class S3Faults : public BlobTest {
 protected:
  using Trouble = FakeS3::Trouble;
  S3Faults() {
    fake_s3().clear();
    store_ = open_s3_blobs(fake_options(), folder_ / "spool").value();
  }
  ~S3Faults() override { fake_s3().clear(); }
  Result<StoredBlob> put(const std::string& text) {
    auto writer = store_->write().value();
    EXPECT_TRUE(writer.write(bytes_of(text)));
    return writer.finish();
  }
  Result<void> place(const std::string& sha256) { return store_->place(sha256, folder_ / "input"); }
  std::unique_ptr<BlobStore> store_;
};

TEST_F(S3Faults, APassingTroubleIsOverComeByAnotherTry) {
  const std::string text = "patience";
  for (const Trouble kind : {Trouble::status_500, Trouble::status_503, Trouble::stalled}) {
    fake_s3().trouble(kind, 1);
    EXPECT_TRUE(put(text + std::to_string(static_cast<int>(kind))));
  }
  const std::string sha256 = put(text)->sha256;
  for (const Trouble kind : {Trouble::status_500, Trouble::status_503, Trouble::stalled, Trouble::cut}) {
    fake_s3().trouble(kind, 1);
    EXPECT_TRUE(place(sha256)) << static_cast<int>(kind);
    std::ifstream in(folder_ / "input");
    EXPECT_EQ(std::string(std::istreambuf_iterator<char>(in), {}), text);
    std::filesystem::remove(folder_ / "input");
  }
}

TEST_F(S3Faults, ALastingTroubleIsToldAndLeavesNothing) {
  const std::string sha256 = put("bytes")->sha256;
  for (const Trouble kind : {Trouble::status_500, Trouble::status_503, Trouble::cut}) {
    fake_s3().trouble(kind, 1000);
    EXPECT_EQ(place(sha256).error().code, "blobs_unavailable");
    EXPECT_FALSE(std::filesystem::exists(folder_ / "input"));
    EXPECT_EQ(store_->remove(sha256).has_value(), kind == Trouble::cut);
    fake_s3().clear();
    static_cast<void>(put("bytes"));
  }
  fake_s3().trouble(Trouble::status_500, 1000);
  EXPECT_EQ(put("others").error().code, "blobs_unavailable");
  EXPECT_EQ(store_->check().error().code, "blobs_unavailable");
  EXPECT_EQ(files_in(folder_ / "spool" / "tmp"), 0U);
}

TEST_F(S3Faults, OtherBytesThanTheNameSaysAreNeverHandedOn) {
  const std::string sha256 = put("right bytes")->sha256;
  fake_s3().trouble(Trouble::wrong_bytes, 1);
  EXPECT_EQ(place(sha256).error().code, "blobs_unavailable");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "input"));

  const auto reader = store_->open_blob(sha256).value();
  std::string text(11, ' ');
  const std::span<std::uint8_t> out(reinterpret_cast<std::uint8_t*>(text.data()), text.size());
  EXPECT_TRUE(reader.read(0, out.first(5)));
  fake_s3().trouble(Trouble::wrong_bytes, 1);
  EXPECT_FALSE(reader.read(5, out.subspan(5)));
}

TEST_F(S3Faults, ARefusalIsNotTriedAgainAndARedirectIsNotFollowed) {
  for (const Trouble kind : {Trouble::refused, Trouble::elsewhere}) {
    const int before = fake_s3().requests();
    fake_s3().trouble(kind, 1000);
    EXPECT_EQ(store_->check().error().code, "blobs_refused");
    EXPECT_EQ(fake_s3().requests(), before + 1);
  }
}

TEST_F(S3Faults, AStoreThatIsNotThereIsUnavailable) {
  S3Options nowhere = fake_options();
  nowhere.endpoint = "http://127.0.0.1:1";
  EXPECT_EQ(open_s3_blobs(nowhere, folder_ / "spool").error().code, "blobs_unavailable");
  nowhere.endpoint = "file:///etc";
  EXPECT_FALSE(open_s3_blobs(nowhere, folder_ / "spool"));
}

}  // namespace
}  // namespace kiln::testing
