// Every system call of a commit as the last one, and as one that fails; and every pair of such calls, the second in the
// attempt after the first.

#include <fstream>

#include "tests/server/blobs/blob_fixture.h"
#include "tests/server/blobs/faulty_files.h"

namespace kiln::testing {
namespace {

const std::string kText = "bytes that must be whole or not there", kOther = "a second result";

enum class Way { upload, adoption };

class BlobCrash : public BlobTest, public ::testing::WithParamInterface<Way> {
 protected:
  /// Puts kText in the way under test.
  Result<StoredBlob> put(BlobStore& store, FaultyFiles& layer) const {
    if (GetParam() == Way::adoption) {
      std::ofstream(folder_ / "result") << kText;
      std::ofstream(folder_ / "other") << kOther;
      const std::vector files{folder_ / "result", folder_ / "other"};
      for (const auto& file : files) layer.written_by_another(file);
      auto stored = store.adopt(files);
      if (!stored) return tl::make_unexpected(stored.error());
      return stored->front();
    }
    auto writer = store.write();
    if (!writer) return tl::make_unexpected(writer.error());
    for (const std::string& half : {kText.substr(0, 9), kText.substr(9)}) {
      if (auto written = writer->write(bytes_of(half)); !written) return tl::make_unexpected(written.error());
    }
    return writer->finish();
  }

  void clear() {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directory(folder_);
  }

  /// A start, and kText put after it, with this blow at this call of theirs; false if there was no such call.
  bool live(FaultyFiles& files, const Blow& blow, int call, bool& acknowledged) const {
    files.restart();
    try {
      const auto store = open_file_blobs(folder_, files).value();
      files.strike(blow, call);
      store->remove_dead_writers();
      const bool stored = put(*store, files).has_value();
      EXPECT_TRUE(stored || blow.error != EINTR);
      acknowledged = stored || acknowledged;
    } catch (const Killed&) {
    }
    const bool struck = files.struck();
    if (blow.power_cut) files.cut_power();
    return struck;
  }

  /// After any end: what is there is sound, nothing half is left, and trying again works.
  void expect_recovers(bool acknowledged) {
    FaultyFiles healthy;
    expect_recovers(acknowledged, healthy);
  }
  void expect_recovers(bool acknowledged, FaultyFiles& healthy) {
    const auto store = open_file_blobs(folder_, healthy).value();
    store->remove_dead_writers();
    for (const std::string& text : {kText, kOther}) {
      const std::string name = sha256_hex(bytes_of(text));
      EXPECT_TRUE(!store->exists(name) || read(*store, name) == text);
    }
    EXPECT_EQ(files_in(folder_ / "tmp"), 0U);
    EXPECT_TRUE(!acknowledged || store->exists(sha256_hex(bytes_of(kText))));
    EXPECT_EQ(read(*store, put(*store, healthy).value().sha256), kText);
  }
};

TEST_P(BlobCrash, AKillAfterAnyCallLosesNothingAcknowledged) {
  for (const bool power_cut : {false, true}) {
    bool killed = true;
    for (int call = 0; killed; ++call) {
      clear();
      FaultyFiles files;
      bool acknowledged = false;
      try {
        const auto store = open_file_blobs(folder_, files).value();
        files.kill_at = files.calls + call;
        acknowledged = put(*store, files).has_value();
        killed = false;
      } catch (const Killed&) {
      }
      if (power_cut) files.cut_power();
      SCOPED_TRACE("after call " + std::to_string(call) + (power_cut ? " with a power cut" : ""));
      expect_recovers(acknowledged);
      ASSERT_LT(call, 100);
    }
  }
}

TEST_P(BlobCrash, AKillWhileTheStoreIsMadeIsMendedByTheNextStart) {
  for (int call = 0; call < 270; call += 9) {  // 259 folders and their syncs
    clear();
    FaultyFiles files;
    files.kill_at = call;
    try {
      static_cast<void>(open_file_blobs(folder_, files));
    } catch (const Killed&) {
    }
    files.cut_power();
    std::filesystem::create_directories(folder_);
    expect_recovers(false);
  }
}

TEST_P(BlobCrash, AFailureOfAnyCallIsToldAndLeavesNothingHalf) {
  for (const int error : {EIO, ENOSPC}) {
    bool failed = true;
    for (int call = 0; failed; ++call) {
      clear();
      FaultyFiles files;
      files.error = error;
      const auto store = open_file_blobs(folder_, files).value();
      files.fail_at = files.calls + call;
      const auto stored = put(*store, files);
      failed = !files.failed_call.empty();
      SCOPED_TRACE("call " + std::to_string(call) + " " + files.failed_call);
      // A folder or a read-only file that does not close properly has lost nothing.
      if (failed && files.failed_call != "close") {
        ASSERT_FALSE(stored);
        EXPECT_EQ(stored.error().code, error == ENOSPC ? "disk_full" : "io_failed");
      }
      files.cut_power();
      expect_recovers(stored.has_value());
      ASSERT_LT(call, 100);
    }
  }
}

TEST_P(BlobCrash, ASecondBlowInTheAttemptAfterTheFirstLosesNothingAcknowledged) {
  FaultyFiles files;
  files.short_writes = true;
  const int pairs = try_pairs(pair_stride(32), [&](const Blow& first, int i, const Blow& second, int j) -> Struck {
    SCOPED_TRACE(std::string(first.name) + " at " + std::to_string(i) + ", then " + second.name + " at " +
                 std::to_string(j));
    bool acknowledged = false;
    const bool struck = live(files, first, i, acknowledged), again = live(files, second, j, acknowledged);
    files.restart();
    expect_recovers(acknowledged, files);
    EXPECT_LT(i + j, 200);
    remove_files({kText, kOther});
    files.keep_all();
    return HasFailure() ? Struck{false, false} : Struck{struck, again};
  });
  std::printf("%d pairs\n", pairs);
}

TEST_P(BlobCrash, InterruptedAndShortCallsAreCarriedOn) {
  FaultyFiles files;
  const auto store = open_file_blobs(folder_, files).value();
  files.interrupt = files.short_writes = true;
  const auto stored = put(*store, files);
  ASSERT_TRUE(stored);
  files.interrupt = files.short_writes = false;
  EXPECT_EQ(read(*store, stored->sha256), kText);
}

INSTANTIATE_TEST_SUITE_P(Ways, BlobCrash, ::testing::Values(Way::upload, Way::adoption),
                         [](const auto& param) { return param.param == Way::upload ? "upload" : "adoption"; });

}  // namespace
}  // namespace kiln::testing
