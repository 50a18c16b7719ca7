// The rules of one run, without a service around.

#include "server/work/run_worker.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>

#include "core/bake/recipe.h"
#include "server/work/content_key.h"
#include "server/work/data_folder.h"
#include "server/work/run_job.h"

namespace kiln {
namespace {

TEST(RunWorker, AProgramThatIsNotThereIsTroubleOfTheMachineAndNotOfTheJob) {
  const StopSignal stop;
  const auto outcome = run_worker({{"/nonexistent/worker"}, "/tmp", 0}, {}, stop, {});
  EXPECT_EQ(outcome.kind, WorkerOutcome::Kind::trouble);
  EXPECT_EQ(outcome.fault.code, "spawn_failed");
}

class WorkerLimitsTest : public ::testing::Test {
 protected:
  WorkerLimitsTest() {
    std::string name = (std::filesystem::temp_directory_path() / "kiln_limits.XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
  }
  ~WorkerLimitsTest() override { std::filesystem::remove_all(folder_); }
  WorkerStart script(const std::string& text) const { return {{"/bin/sh", "-c", text}, folder_, 64u << 20}; }
  std::filesystem::path folder_;
};

TEST_F(WorkerLimitsTest, ProcessorTimeEndsAWorkerWithoutAnybodyWatchingTheClock) {
  WorkerStart start = script("while :; do :; done");
  start.cpu_s = 1;
  const auto outcome = run_worker(start, {}, StopSignal(), {});
  EXPECT_EQ(outcome.kind, WorkerOutcome::Kind::timed_out);
  EXPECT_EQ(outcome.fault.where, "/limits/wall_s");
}

TEST_F(WorkerLimitsTest, AFileOfAWorkerHasAnEnd) {
  // Limits are set while the worker already starts: this one waits for its own.
  WorkerStart start =
      script("until [ \"$(ulimit -f)\" != unlimited ]; do :; done; truncate -s 100G big; truncate -s 1G small");
  start.cpu_s = 20;
  static_cast<void>(run_worker(start, {}, StopSignal(), {}));
  EXPECT_LT(std::filesystem::file_size(folder_ / "big"), 8ULL << 30);
  EXPECT_EQ(std::filesystem::file_size(folder_ / "small"), 1ULL << 30);
}

TEST(RunWorker, TheFirstReasonToStopCounts) {
  StopSignal stop;
  EXPECT_EQ(stop.asked(), StopReason::none);
  stop.ask(StopReason::cancel);
  stop.ask(StopReason::drain);
  EXPECT_EQ(stop.asked(), StopReason::cancel);
}

TEST(RetryDelay, GrowsFourfoldWithJitterUpToAnHour) {
  EXPECT_EQ(retry_delay(Millis(10'000), 0, 0), Millis(10'000));
  EXPECT_EQ(retry_delay(Millis(10'000), 2, 0), Millis(160'000));
  EXPECT_EQ(retry_delay(Millis(10'000), 2, 1), Millis(200'000));
  EXPECT_EQ(retry_delay(Millis(10'000), 9, 1), Millis(3'600'000));
}

TEST(ContentKey, DependsOnEverythingThatDecidesTheResultAndOnNothingElse) {
  JobInputs inputs;
  inputs.scene = {"a.gltf", std::string(64, 'a')};
  inputs.resources = {{"x.bin", std::string(64, 'b')}, {"y.bin", std::string(64, 'c')}};
  Recipe recipe;
  const std::string key = content_key("", inputs, recipe);

  JobInputs same = inputs;
  same.scene.name = "b.gltf";
  std::swap(same.resources[0], same.resources[1]);
  Recipe labelled = recipe;
  labelled.label = "label";
  labelled.limits.threads = 7;
  EXPECT_EQ(content_key("", same, labelled), key);

  JobInputs other = inputs;
  other.resources[0].name = "z.bin";
  EXPECT_NE(content_key("", other, recipe), key);
  other = inputs;
  other.scene.sha256[0] = 'b';
  EXPECT_NE(content_key("", other, recipe), key);
  other = inputs;
  other.environment = NamedBlob{"sky.hdr", std::string(64, 'd')};
  EXPECT_NE(content_key("", other, recipe), key);
  Recipe seeded = recipe;
  seeded.seed = 1;
  EXPECT_NE(content_key("", inputs, seeded), key);
  EXPECT_NE(content_key("studio", inputs, recipe), key);
}

TEST(DiskSpace, AFolderOnADiskHasSomeOfItFree) {
  const DiskSpace space = disk_space("/");
  EXPECT_GE(space.free_fraction, 0);
  EXPECT_LE(space.free_fraction, 1);
}

}  // namespace
}  // namespace kiln
