// The service with real processes: every way a worker can end becomes a job's end with its reason.

#include <algorithm>
#include <fstream>
#include <thread>

#include "core/base/sha256.h"
#include "tests/fixtures/fake_s3.h"
#include "tests/server/work/service_fixture.h"

namespace kiln::testing {
namespace {

std::string text_of(const BlobReader& reader) {
  std::string text(reader.size(), ' ');
  EXPECT_EQ(reader.read(0, {reinterpret_cast<std::uint8_t*>(text.data()), text.size()}).value(), text.size());
  return text;
}

std::string failure(const Job& job) { return job.error ? job.error->fault.code : "none"; }

TEST_F(ServiceTest, AJobRunsAndItsArtefactsHaveTheHashesTheyAreNamedBy) {
  start();
  const Job job = finish("ok");
  ASSERT_EQ(job.state, JobState::succeeded) << failure(job);
  ASSERT_EQ(job.artifacts.size(), 2U);
  const auto scene = service_->open_artifact(job.id, "scene.glb").value();
  const std::string text = text_of(scene.reader);
  EXPECT_TRUE(text.starts_with("baked "));
  EXPECT_EQ(scene.artifact.bytes, text.size());
  EXPECT_EQ(scene.artifact.sha256, sha256_hex({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}));
  EXPECT_EQ(service_->open_artifact(job.id, "other").error().code, "not_found");
  EXPECT_EQ(entries("work"), 0U);
  EXPECT_EQ(entries("tmp"), 0U);
}

TEST_F(ServiceTest, TheSameJobIsNotBakedTwiceUnlessForced) {
  start();
  Submission job = submission("ok");
  const Job first = service_->wait_done(service_->submit(job)->job.id, 20s).value();
  job.recipe.label = "another name";
  job.recipe.limits.threads = 2;
  const Job second = service_->submit(job).value().job;
  EXPECT_EQ(second.state, JobState::succeeded);
  EXPECT_TRUE(second.cached);
  ASSERT_EQ(second.artifacts.size(), first.artifacts.size());
  EXPECT_EQ(second.artifacts[0].sha256, first.artifacts[0].sha256);
  job.force = true;
  const Job third = service_->wait_done(service_->submit(job)->job.id, 20s).value();
  EXPECT_FALSE(third.cached);
  EXPECT_EQ(third.attempt, 1);
}

TEST_F(ServiceTest, ATwinThatWaitedTakesTheResultOfTheFirst) {
  start();
  const Submission job = submission("slow");
  const std::string first = service_->submit(job)->job.id;
  const std::string second = service_->submit(job)->job.id;
  EXPECT_NE(first, second);
  EXPECT_FALSE(service_->wait_done(first, 20s)->cached);
  EXPECT_TRUE(service_->wait_done(second, 20s)->cached);
}

TEST_F(ServiceTest, AFaultOfTheInputBecomesTheJobsFaultWith422) {
  start();
  const Job job = finish("refuse");
  EXPECT_EQ(failure(job), "accessor_out_of_bounds");
  EXPECT_EQ(job.error->status, 422);
  EXPECT_EQ(job.error->fault.where, "scene.glb: /meshes/0");
}

TEST_F(ServiceTest, ACrashIsRetriedOnce) {
  start();
  const Job job = finish("crash-once");
  EXPECT_EQ(job.state, JobState::succeeded) << failure(job);
  EXPECT_EQ(job.attempt, 2);
  EXPECT_EQ(job.crashes, 1);
}

TEST_F(ServiceTest, ACheckpointOutlivesItsWorkerAndGoesWithItsJob) {
  start();
  const Job job = finish("resume");
  ASSERT_EQ(job.state, JobState::succeeded) << failure(job);
  EXPECT_EQ(job.attempt, 2);
  const auto file = service_->open_artifact(job.id, "log.txt");
  ASSERT_TRUE(file);
  EXPECT_EQ(file->artifact.bytes, std::string("as far as this").size());
  EXPECT_EQ(entries("checkpoints"), 0U);
}

TEST_F(ServiceTest, CheckpointsOfJobsThatAreGoneAreRemovedAtTheNextStart) {
  open();
  std::ofstream(options_.data / "checkpoints" / "some-job") << "text";
  open();
  EXPECT_EQ(entries("checkpoints"), 0U);
}

TEST_F(ServiceTest, TheSecondCrashFailsTheJobAndPoisonsItsContent) {
  start();
  const Submission bad = submission("crash");
  const Job job = service_->wait_done(service_->submit(bad)->job.id, 20s).value();
  EXPECT_EQ(failure(job), "worker_crashed");
  EXPECT_EQ(job.attempt, 2);
  EXPECT_EQ(service_->submit(bad).error().code, "poisoned");
  EXPECT_EQ(finish("ok").state, JobState::succeeded) << "the server lives";
  EXPECT_EQ(service_->stats().deaths_signal, 2U);
}

TEST_F(ServiceTest, AJobPastItsWallLimitIsEnded) {
  start();
  Submission job = submission("stubborn");
  job.recipe.limits.wall_s = 1;
  const Job ended = service_->wait_done(service_->submit(job)->job.id, 20s).value();
  EXPECT_EQ(failure(ended), "timed_out");
  EXPECT_EQ(ended.error->status, 422);
}

TEST_F(ServiceTest, AJobPastItsMemoryLimitIsEnded) {
  start();
  Submission job = submission("oom");
  job.recipe.limits.memory_mb = 256;
  const Job ended = service_->wait_done(service_->submit(job)->job.id, 20s).value();
  EXPECT_EQ(failure(ended), "out_of_memory");
  EXPECT_EQ(ended.error->fault.where, "/limits/memory_mb");
  EXPECT_EQ(failure(finish("bad-alloc")), "out_of_memory");
  EXPECT_EQ(service_->stats().deaths_memory, 2U);
}

TEST_F(ServiceTest, AWorkerThatBreaksTheProtocolFailsItsJobAndNothingElse) {
  start();
  for (const char* label : {"garbage", "silent", "liar", "escape"}) {
    const Job job = finish(label);
    EXPECT_EQ(failure(job), "internal") << label;
    EXPECT_TRUE(job.artifacts.empty());
  }
  EXPECT_EQ(finish("ok").state, JobState::succeeded);
}

TEST_F(ServiceTest, AFullDiskIsRetriedAndThenTold) {
  start();
  options_.first_retry = Millis(1);
  start();
  const Job job = finish("full");
  EXPECT_EQ(failure(job), "disk_full");
  EXPECT_EQ(job.error->status, 507);
  EXPECT_EQ(job.retries, 5);
}

TEST_F(ServiceTest, CancelTakesEffectWithinASecondEvenOnAWorkerThatIgnoresTerm) {
  start();
  for (const char* label : {"hang", "stubborn"}) {
    const std::string id = submit(label).id;
    wait_running(id);
    const auto asked = std::chrono::steady_clock::now();
    EXPECT_TRUE(service_->cancel(id));
    const Job job = service_->wait_done(id, 5s).value();
    EXPECT_EQ(job.state, JobState::canceled) << label;
    EXPECT_LT(std::chrono::steady_clock::now() - asked, 1s) << label;  // contract.md 3
    EXPECT_EQ(service_->cancel(id)->state, JobState::canceled);
  }
  EXPECT_EQ(entries("work"), 0U);
}

TEST_F(ServiceTest, RemovingARunningJobEndsItFirst) {
  start();
  const std::string id = submit("hang").id;
  wait_running(id);
  EXPECT_TRUE(service_->remove(id));
  EXPECT_EQ(service_->get(id).error().code, "not_found");
  EXPECT_EQ(service_->remove(id).error().code, "not_found");
}

TEST_F(ServiceTest, DrainPutsARunningJobBackWithoutLosingAnAttempt) {
  start();
  const std::string id = submit("slow").id;
  wait_running(id);
  service_->drain();
  EXPECT_EQ(service_->get(id)->state, JobState::queued);
  EXPECT_EQ(service_->get(id)->attempt, 0);
  EXPECT_EQ(service_->submit(Submission{}).error().code, "draining");
  start();
  const Job job = service_->wait_done(id, 20s).value();
  EXPECT_EQ(job.state, JobState::succeeded);
  EXPECT_EQ(job.attempt, 1);
}

TEST_F(ServiceTest, ASecondServerOnTheSameDataIsRefused) {
  open();
  EXPECT_EQ(Service::open(options_).error().code, "data_in_use");
}

TEST_F(ServiceTest, AStartRemovesWhatADeadServerLeft) {
  open();
  service_.reset();
  std::filesystem::create_directories(options_.data / "work" / "01DEAD.token" / "out");
  std::ofstream(options_.data / "tmp" / "new.123") << "half";
  std::ofstream(options_.data / "tmp" / ("part." + std::string(64, 'a'))) << "to be resumed";
  open();
  EXPECT_EQ(entries("work"), 0U);
  EXPECT_EQ(entries("tmp"), 1U);
  EXPECT_EQ(service_->asset_offset(std::string(64, 'a'), ""), 13U);
}

TEST_F(ServiceTest, ANearlyFullDiskRefusesUploadsAndLetsTheQueueWait) {
  open();
  const Submission job = submission("ok");
  options_.soft_free_fraction = options_.hard_free_fraction = 1;  // no disk is that empty
  start();
  EXPECT_EQ(service_->put_asset({}).error().code, "disk_full");
  const std::string id = service_->submit(job)->job.id;
  EXPECT_EQ(service_->wait_done(id, 500ms)->state, JobState::queued);
  EXPECT_EQ(unready(), (std::vector<std::string>{"the disk is nearly full: jobs wait"}));
  options_.soft_free_fraction = options_.hard_free_fraction = 0;
  start();
  EXPECT_EQ(service_->wait_done(id, 20s)->state, JobState::succeeded);
  EXPECT_TRUE(unready().empty());
}

TEST_F(ServiceTest, AJobWhoseInputsComeSlowlyKeepsItsLease) {
  FakeS3 store;
  options_.stores.blobs = std::string("s3://") + FakeS3::kBucket;
  options_.stores.s3_endpoint = store.endpoint();
  options_.stores.s3_key = options_.stores.s3_secret = "fake";
  options_.lease = 1s;
  open();
  const std::string id = submit("ok").id;
  store.trouble(FakeS3::Trouble::stalled, 1);  // three seconds for the first input
  service_->start();
  const Job job = service_->wait_done(id, 20s).value();
  EXPECT_EQ(job.state, JobState::succeeded);
  EXPECT_EQ(job.attempt, 1) << "the lease ended while the input came";
}

TEST_F(ServiceTest, AnUnusedAssetIsCollectedAndAUsedOneIsNot) {
  options_.blob_grace = Millis(0);
  start();
  const std::string unused = put("nobody wants this");
  const Job job = finish("ok");
  for (int i = 0; i < 100 && std::filesystem::exists(options_.data / "cas" / unused.substr(0, 2) / unused); ++i) {
    std::this_thread::sleep_for(50ms);
  }
  EXPECT_FALSE(service_->has_asset(unused, {}));
  EXPECT_FALSE(std::filesystem::exists(options_.data / "cas" / unused.substr(0, 2) / unused));
  EXPECT_TRUE(service_->open_artifact(job.id, "scene.glb"));
  EXPECT_TRUE(service_->has_asset(job.inputs.scene.sha256, {}));
}

TEST_F(ServiceTest, APlanRunsInAProcessOfItsOwn) {
  start();
  EXPECT_EQ(service_->plan(submission("ok")).value(), R"({"plan":[]})");
  EXPECT_EQ(entries("work"), 0U);
  Submission missing = submission("ok");
  missing.scene_sha256 = std::string(64, 'b');
  EXPECT_EQ(service_->plan(missing).error().code, "asset_not_found");
}

TEST_F(ServiceTest, JobsWaitForTheMemoryThatTheyDeclare) {
  options_.workers = 2;
  options_.memory_mb = 6000;
  start();
  Submission big = submission("hang"), other = submission("hang"), small = submission("hang");
  big.recipe.limits.memory_mb = other.recipe.limits.memory_mb = 4096;
  small.recipe.limits.memory_mb = 1024;
  const std::string first = service_->submit(big).value().job.id;
  wait_running(first);
  const std::string second = service_->submit(other).value().job.id, third = service_->submit(small).value().job.id;
  wait_running(third);
  EXPECT_EQ(service_->get(second)->state, JobState::queued) << "two of 4096 MB do not fit into 6000 MB";
  service_->cancel(first).value();
  wait_running(second);
  for (const std::string& id : {second, third}) service_->cancel(id).value();
}

TEST_F(ServiceTest, RangesOfABakeAreComputedByTheOtherWorkerAndNobodyHearsOfThem) {
  options_.workers = 2;
  start();
  const auto stream = service_->subscribe("", {}).value();
  const Job job = finish("share");
  EXPECT_EQ(job.state, JobState::succeeded);
  EXPECT_NE(text_of(service_->open_artifact(job.id, "log.txt")->reader), "0") << "the other worker took nothing";
  EXPECT_GE(service_->stats().parts, 1U);
  while (const auto event = stream->next(0ms)) EXPECT_EQ(event->job_id, job.id);
}

TEST_F(ServiceTest, TwoWorkersRunTwoJobsAtATime) {
  options_.workers = 2;
  start();
  const std::string first = submit("hang").id, second = submit("hang").id;
  wait_running(first);
  wait_running(second);
  EXPECT_EQ(service_->stats().jobs.running, 2U);
}

}  // namespace
}  // namespace kiln::testing
