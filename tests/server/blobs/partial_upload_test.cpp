// Uploads in pieces, in every place of blobs; and every system call of a piece as the last one (files alone).

#include "server/blobs/partial_upload.h"

#include <atomic>
#include <fstream>
#include <functional>
#include <thread>
#include <utility>
#include <vector>

#include "tests/server/blobs/blob_conformance.h"
#include "tests/server/blobs/faulty_files.h"

namespace kiln::testing {
namespace {

const std::string kText = "the first piece, the second piece, and the end";

PartialUpload wanted(const std::string& tenant = "studio") {
  PartialUpload upload;
  upload.id = std::string(31, 'a') + "1";
  upload.tenant = tenant;
  upload.length = kText.size();
  upload.metadata = "filename c2NlbmU=";
  return upload;
}

Result<PartialUpload> send(PartialUploads& uploads, const PartialUpload& upload, std::size_t from, std::size_t to) {
  KILN_TRY(writer, uploads.append(upload, from));
  if (auto written = writer.write(bytes_of(kText.substr(from, to - from))); !written) {
    return tl::make_unexpected(written.error());
  }
  return writer.keep();
}

TEST_P(BlobConformance, AnUploadInPiecesBecomesItsBlob) {
  PartialUploads uploads(store());
  const PartialUpload begun = uploads.begin(wanted()).value();
  EXPECT_EQ(begun.offset, 0U);
  EXPECT_GT(begun.expires_s, ::time(nullptr) + 23 * 3600);
  EXPECT_EQ(send(uploads, begun, 0, 17)->offset, 17U);
  EXPECT_EQ(uploads.unfinished("studio"), 1);
  const PartialUpload whole = send(uploads, begun, 17, kText.size()).value();
  const StoredBlob blob = uploads.store(whole).value();
  EXPECT_EQ(read(store(), blob.sha256), kText);
  // A crash before finish(): the blob is found again.
  EXPECT_EQ(uploads.store(uploads.find(whole.id, "studio").value())->sha256, blob.sha256);
  ASSERT_TRUE(uploads.finish(whole, blob.sha256));
  const PartialUpload done = uploads.find(whole.id, "studio").value();
  EXPECT_TRUE(done.done);
  EXPECT_EQ(done.sha256, blob.sha256);
  EXPECT_EQ(done.metadata, begun.metadata);
  EXPECT_EQ(uploads.unfinished("studio"), 0);
  EXPECT_TRUE(uploads.remove(done));
  EXPECT_EQ(spooled(), 0U);
}

TEST_P(BlobConformance, AnUploadInPiecesHasOneWriterAndOneOffset) {
  PartialUploads uploads(store());
  const PartialUpload upload = uploads.begin(wanted()).value();
  {
    auto writer = uploads.append(upload, 0).value();
    EXPECT_EQ(uploads.append(upload, 0).error().code, "upload_busy");
    EXPECT_EQ(uploads.remove(upload).error().code, "upload_busy");
    EXPECT_TRUE(writer.write(bytes_of(kText.substr(0, 5))));
  }  // cut: what came counts
  EXPECT_EQ(uploads.find(upload.id, "studio")->offset, 5U);
  EXPECT_EQ(uploads.append(upload, 0).error().code, "offset_mismatch");
  EXPECT_EQ(uploads.append(upload, 6).error().code, "offset_mismatch");
  EXPECT_EQ(uploads.begin(wanted())->offset, 5U) << "asked for again";
  auto writer = uploads.append(upload, 5).value();
  EXPECT_EQ(writer.write(bytes_of(kText)).error().code, "too_large");
}

TEST_P(BlobConformance, ATenantBeginsSoManyUploadsHoweverManyAskAtOnce) {
  constexpr int kMost = 7, kEach = 5;
  const auto other_store = open();  // another program with the same spool
  PartialUploads uploads(store()), others(*other_store);
  std::atomic<int> begun{0}, refused{0};
  std::vector<std::thread> threads;
  for (int t = 0; t < 6; ++t) {
    threads.emplace_back([&, t] {
      for (int i = 0; i < kEach; ++i) {
        PartialUpload mine = wanted();
        mine.id = std::string(30, 'b') + std::to_string(t) + std::to_string(i);
        const auto made = (t % 2 == 0 ? uploads : others).begin(mine, kMost);
        EXPECT_EQ(made ? "" : made.error().code, made ? "" : "quota");
        ++(made ? begun : refused);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(begun, kMost);
  EXPECT_EQ(refused, 6 * kEach - kMost);
  EXPECT_EQ(uploads.unfinished("studio"), kMost);
  EXPECT_TRUE(uploads.begin(wanted("another"), kMost)) << "of each tenant";
}

TEST_P(BlobConformance, AnUploadInPiecesGoesOnThroughAnotherProgramWithTheSameSpool) {
  PartialUploads uploads(store());
  const PartialUpload upload = uploads.begin(wanted()).value();
  ASSERT_TRUE(send(uploads, upload, 0, 5));
  const auto other_store = open();
  PartialUploads others(*other_store);
  EXPECT_EQ(others.find(upload.id, "studio")->offset, 5U);
  {
    const auto writer = uploads.append(upload, 5).value();
    EXPECT_EQ(others.append(upload, 5).error().code, "upload_busy");
  }
  const PartialUpload whole = send(others, upload, 5, kText.size()).value();
  EXPECT_EQ(read(store(), others.store(whole)->sha256), kText);
}

TEST_P(BlobConformance, APieceThatCountsWholeOrNotAtAllLeavesNothingWhenItIsDropped) {
  PartialUploads uploads(store());
  const PartialUpload upload = uploads.begin(wanted()).value();
  ASSERT_TRUE(send(uploads, upload, 0, 5));
  {
    auto writer = uploads.append(upload, 5).value();
    writer.all_or_nothing();
    EXPECT_TRUE(writer.write(bytes_of("other bytes")));
  }
  EXPECT_EQ(uploads.find(upload.id, "studio")->offset, 5U);
  const PartialUpload whole = send(uploads, upload, 5, kText.size()).value();
  EXPECT_EQ(uploads.store(whole)->sha256, sha256_hex(bytes_of(kText)));
}

TEST_P(BlobConformance, AnUploadInPiecesWithOtherBytesThanAnnouncedIsGone) {
  PartialUploads uploads(store());
  PartialUpload lie = wanted();
  lie.expected = std::string(64, 'b');
  const PartialUpload whole = send(uploads, uploads.begin(lie).value(), 0, kText.size()).value();
  EXPECT_EQ(uploads.store(whole).error().code, "hash_mismatch");
  EXPECT_FALSE(store().exists(sha256_hex(bytes_of(kText))));
  EXPECT_EQ(uploads.find(lie.id, "studio").error().code, "not_found");
  EXPECT_EQ(spooled(), 0U);
}

TEST_P(BlobConformance, AnUploadInPiecesIsItsTenantsAndExpires) {
  PartialUploads uploads(store());
  const PartialUpload upload = uploads.begin(wanted()).value();
  EXPECT_EQ(uploads.find(upload.id, "other").error().code, "not_found");
  EXPECT_EQ(uploads.find("../" + upload.id, "studio").error().code, "not_found");
  EXPECT_EQ(uploads.append(wanted("other"), 0).error().code, "not_found");
  EXPECT_EQ(store().remove_dead_writers(), 0) << "a restart keeps it";
  EXPECT_EQ(store().expire_partials(3600), 0);
  {
    const auto writer = uploads.append(upload, 0).value();
    store().expire_partials(0);
    EXPECT_EQ(uploads.append(upload, 0).error().code, "upload_busy") << "not while somebody writes it";
  }
  store().expire_partials(0);
  EXPECT_EQ(spooled(), 0U);
  EXPECT_EQ(uploads.find(upload.id, "studio").error().code, "not_found");
}

TEST_P(BlobConformance, TwoMayCompleteAnUploadInPiecesAtOnce) {
  PartialUploads uploads(store());
  const PartialUpload whole = send(uploads, uploads.begin(wanted()).value(), 0, kText.size()).value();
  const StoredBlob blob = uploads.store(whole).value();
  const auto again = uploads.store(whole);  // by somebody who looked at it before
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->sha256, blob.sha256);
  EXPECT_TRUE(uploads.finish(whole, blob.sha256));
  EXPECT_EQ(uploads.store(whole)->sha256, blob.sha256);
  EXPECT_TRUE(uploads.finish(whole, blob.sha256));
}

/// Does something else just before a file is opened or renamed.
class Interrupted final : public FileLayer {
 public:
  std::function<void()> before_open, before_rename;
  std::string opened;  // suffix of the file
  int open(const std::string& path, int flags, unsigned mode) override {
    if (before_open && path.ends_with(opened)) std::exchange(before_open, nullptr)();
    return FileLayer::open(path, flags, mode);
  }
  int rename(const std::string& from, const std::string& to) override {
    if (before_rename) std::exchange(before_rename, nullptr)();
    return FileLayer::rename(from, to);
  }
};

class PieceRace : public BlobTest {};

TEST_F(PieceRace, AnUploadThatBecomesItsBlobMeanwhileIsFound) {
  Interrupted files;
  const auto blobs = open_file_blobs(folder_, files).value();
  PartialUploads uploads(*blobs);
  const PartialUpload whole = send(uploads, uploads.begin(wanted()).value(), 0, kText.size()).value();
  const StoredBlob blob = uploads.store(whole).value();
  files.opened = ".info";
  files.before_open = [&] { EXPECT_TRUE(uploads.finish(whole, blob.sha256)); };
  const auto found = uploads.find(whole.id, "studio");
  EXPECT_FALSE(files.before_open);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_TRUE(found->done);
}

TEST_F(PieceRace, TwoMayWriteTheLastRecordOfAnUploadAtOnce) {
  Interrupted files;
  const auto blobs = open_file_blobs(folder_, files).value();
  PartialUploads uploads(*blobs);
  const PartialUpload whole = send(uploads, uploads.begin(wanted()).value(), 0, kText.size()).value();
  const StoredBlob blob = uploads.store(whole).value();
  files.before_rename = [&] { EXPECT_TRUE(uploads.finish(whole, blob.sha256)); };
  const auto finished = uploads.finish(whole, blob.sha256);
  EXPECT_TRUE(finished) << finished.error().message;
  EXPECT_TRUE(uploads.find(whole.id, "studio")->done);
  EXPECT_EQ(files_in(folder_ / "tmp"), 1U);
}

class PieceCrash : public BlobTest {
 protected:
  /// How much was acknowledged before the end, and whether the whole blob was.
  struct Acknowledged {
    std::uint64_t bytes = 0;
    bool blob = false;
  };
  static void upload(BlobStore& blobs, Acknowledged& told) {
    PartialUploads uploads(blobs);
    auto begun = uploads.begin(wanted());
    if (!begun) return;
    told.bytes = std::max(told.bytes, begun->offset);  // a client that asks may forget what it has sent
    told.blob = told.blob || begun->done;
    if (begun->done) return;
    for (const std::size_t end : {std::size_t{17}, std::size_t{30}, kText.size()}) {
      if (begun->offset >= end) continue;
      begun = send(uploads, *begun, begun->offset, end);
      if (!begun) return;
      told.bytes = begun->offset;
    }
    const auto stored = uploads.store(*begun);
    if (stored) told.blob = uploads.finish(*begun, stored->sha256).has_value();
  }
  /// A start, and the upload from where it is, with this blow at this call of theirs; false if there was no such call.
  bool live(FaultyFiles& files, const Blow& blow, int call, Acknowledged& told) const {
    files.restart();
    try {
      const auto blobs = open_file_blobs(folder_, files).value();
      files.strike(blow, call);
      blobs->remove_dead_writers();
      upload(*blobs, told);
      EXPECT_TRUE(told.blob || blow.error != EINTR);
    } catch (const Killed&) {
    }
    const bool struck = files.struck();
    // A failed sync of bytes means that the upload is lost, and that is what the next question is told.
    if (files.failed_call == "fsync") told = {};
    if (blow.power_cut) files.cut_power();
    return struck;
  }
  /// What was acknowledged is there, and the rest can be sent.
  void expect_goes_on(const Acknowledged& told) const {
    FaultyFiles healthy;
    expect_goes_on(told, healthy);
  }
  void expect_goes_on(const Acknowledged& told, FaultyFiles& healthy) const {
    const auto blobs = open_file_blobs(folder_, healthy).value();
    blobs->remove_dead_writers();
    PartialUploads uploads(*blobs);
    auto known = uploads.begin(wanted());
    ASSERT_TRUE(known) << known.error().message;
    EXPECT_GE(known->offset, told.bytes);
    EXPECT_TRUE(!told.blob || known->done);
    if (!known->done && known->offset < kText.size()) known = send(uploads, *known, known->offset, kText.size());
    ASSERT_TRUE(known) << known.error().message;
    const auto stored = known->done ? StoredBlob{known->sha256} : uploads.store(*known).value();
    EXPECT_EQ(read(*blobs, stored.sha256), kText);
  }
};

TEST_F(PieceCrash, AKillAfterAnyCallKeepsEveryAcknowledgedByte) {
  for (const bool power_cut : {false, true}) {
    bool killed = true;
    for (int call = 0; killed; ++call) {
      remove_files({kText});
      FaultyFiles files;
      Acknowledged told;
      try {
        const auto blobs = open_file_blobs(folder_, files).value();
        files.kill_at = files.calls + call;
        upload(*blobs, told);
        killed = false;
      } catch (const Killed&) {
      }
      if (power_cut) files.cut_power();
      SCOPED_TRACE("after call " + std::to_string(call) + (power_cut ? " with a power cut" : ""));
      expect_goes_on(told);
      ASSERT_LT(call, 200);
    }
  }
}

TEST_F(PieceCrash, AFailureOfAnyCallIsToldAndWhatWasAcknowledgedStays) {
  for (const int error : {EIO, ENOSPC}) {
    bool failed = true;
    for (int call = 0; failed; ++call) {
      remove_files({kText});
      FaultyFiles files;
      files.error = error;
      const auto blobs = open_file_blobs(folder_, files).value();
      files.fail_at = files.calls + call;
      Acknowledged told;
      upload(*blobs, told);
      failed = !files.failed_call.empty();
      SCOPED_TRACE("call " + std::to_string(call) + " " + files.failed_call);
      // A failed sync of bytes means that the upload is lost, and that is what the next question is told.
      if (files.failed_call == "fsync") told = {};
      expect_goes_on(told);
      ASSERT_LT(call, 200);
    }
  }
}

TEST_F(PieceCrash, ASecondBlowWhenItGoesOnKeepsWhatWasAcknowledged) {
  FaultyFiles files;
  const int pairs = try_pairs(pair_stride(128), [&](const Blow& first, int i, const Blow& second, int j) -> Struck {
    SCOPED_TRACE(std::string(first.name) + " at " + std::to_string(i) + ", then " + second.name + " at " +
                 std::to_string(j));
    Acknowledged told;
    const bool struck = live(files, first, i, told), again = live(files, second, j, told);
    files.restart();
    expect_goes_on(told, files);
    EXPECT_LT(i + j, 400);
    remove_files({kText});
    files.keep_all();
    return HasFailure() ? Struck{false, false} : Struck{struck, again};
  });
  std::printf("%d pairs\n", pairs);
}

}  // namespace
}  // namespace kiln::testing
