// The rules of one run, without a service around.

#include "server/work/run_worker.h"

#include <gtest/gtest.h>

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
