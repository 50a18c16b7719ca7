// Ranges that a running job gives away, and which jobs a server with so much memory takes.

#include "tests/server/jobs/store_conformance.h"

namespace kiln::testing {
namespace {

NewParts two_parts(const std::string& journal) { return {{"first", "second"}, "engine cpu", {journal, 7}}; }

const Taker kSameMaker{.maker = "engine cpu"};

TEST_P(StoreClaims, PartsAreJobsWithTheInputsOfTheirs) {
  create("big");
  const Claim parent = claim();
  EXPECT_EQ(store().add_parts(parent.ref, two_parts(sha('d'))), Wrote::done);
  const Claim part = store().claim(kTestLease, kSameMaker).value().value();
  ASSERT_TRUE(part.job.part);
  EXPECT_EQ(part.job.part->parent, parent.ref.job_id);
  EXPECT_EQ(part.job.part->order, "first");
  EXPECT_EQ(part.job.part->journal, sha('d'));
  EXPECT_EQ(part.job.inputs.scene, parent.job.inputs.scene);
  EXPECT_EQ(part.job.recipe, parent.job.recipe);
  EXPECT_EQ(part.job.tenant, parent.job.tenant);
  EXPECT_EQ(store().commit(part.ref, std::vector{artifact("log.txt"), artifact("range")}, false), Wrote::done);

  const auto parts = store().parts(parent.ref.job_id).value();
  ASSERT_EQ(parts.size(), 2U);
  EXPECT_EQ(parts[0].order, "first");
  EXPECT_EQ(parts[0].maker, "engine cpu");
  EXPECT_EQ(parts[0].state, JobState::succeeded);
  EXPECT_EQ(parts[0].sha256, artifact("range").sha256);
  EXPECT_EQ(parts[1].order, "second");
  EXPECT_EQ(parts[1].state, JobState::queued);
}

TEST_P(StoreClaims, OnlyWhoMakesTheSameBitsTakesAPart) {
  create();
  const Claim parent = claim();
  store().add_parts(parent.ref, two_parts(sha('d'))).value();
  EXPECT_FALSE(store().claim(kTestLease, {.maker = "another engine"}).value());
  EXPECT_TRUE(store().claim(kTestLease, kSameMaker).value());
}

TEST_P(StoreClaims, AJobTakesAPartOfItsOwnOnce) {
  create();
  const Claim parent = claim();
  store().add_parts(parent.ref, two_parts(sha('d'))).value();
  const std::string id = store().parts(parent.ref.job_id).value().front().id;
  const Claim own = store().claim_part(id, kTestLease).value().value();
  EXPECT_FALSE(store().claim_part(id, kTestLease).value());
  EXPECT_EQ(store().release(own.ref), Wrote::done);
  EXPECT_TRUE(store().claim_part(id, kTestLease).value());
  EXPECT_FALSE(store().claim_part(parent.ref.job_id, kTestLease).value()) << "no part";
}

TEST_P(StoreClaims, JobsComeBeforePartsOfTheSameTenant) {
  create();
  const Claim parent = claim();
  store().add_parts(parent.ref, two_parts(sha('d'))).value();
  const std::string later = create("small").id;
  EXPECT_EQ(store().claim(kTestLease, kSameMaker).value().value().ref.job_id, later);
  EXPECT_TRUE(store().claim(kTestLease, kSameMaker).value().value().job.part);
}

TEST_P(StoreClaims, PartsEndWithTheirJob) {
  const std::vector<std::function<void(const ClaimRef&)>> ends{
      [&](const ClaimRef& ref) { store().commit(ref, std::vector{artifact()}, false).value(); },
      [&](const ClaimRef& ref) {
        store().fail(ref, {{"internal", "it broke", ""}, 500}).value();
      },
      [&](const ClaimRef& ref) {
        store().cancel(ref.job_id).value();
        store().finish_cancel(ref).value();
      },
      [&](const ClaimRef& ref) {
        store().cancel(ref.job_id).value();
        store().reap(true).value();
      }};
  for (const auto& end : ends) {
    create();
    const Claim parent = claim();
    store().add_parts(parent.ref, two_parts(sha('d'))).value();
    const Claim part = store().claim(kTestLease, kSameMaker).value().value();
    end(parent.ref);
    EXPECT_EQ(store().heartbeat(part.ref, kTestLease, std::nullopt), Beat::lost);
    EXPECT_EQ(store().commit(part.ref, std::vector{artifact("range")}, false), Wrote::lost);
    EXPECT_TRUE(store().parts(parent.ref.job_id).value().empty());
    EXPECT_FALSE(store().claim(kTestLease, kSameMaker).value());
  }
}

TEST_P(StoreClaims, PartsOutliveAWorkerOfTheirJob) {
  create();
  const Claim lost = claim();
  store().add_parts(lost.ref, two_parts(sha('d'))).value();
  store().claim(kTestLease, kSameMaker).value().value();
  clock_.now_ms += kTestLease.count() + 1;
  EXPECT_EQ(store().reap().value(), 2) << "the job and the part that ran";
  EXPECT_EQ(store().add_parts(lost.ref, two_parts(sha('d'))), Wrote::lost);
  const Claim again = claim();
  EXPECT_EQ(again.ref.job_id, lost.ref.job_id);
  EXPECT_EQ(store().parts(lost.ref.job_id).value().size(), 2U);
  EXPECT_TRUE(store().forget_parts(lost.ref));
  EXPECT_EQ(store().parts(lost.ref.job_id).value().size(), 2U) << "they are of use to the one who has the job now";
  EXPECT_TRUE(store().forget_parts(again.ref));
  EXPECT_TRUE(store().parts(lost.ref.job_id).value().empty());
}

TEST_P(StoreClaims, PartsAreInNoListCountOrStream) {
  const std::string id = create().id;
  const Claim parent = claim();
  const std::uint64_t before = store().last_event_id().value();
  store().add_parts(parent.ref, two_parts(sha('d'))).value();
  EXPECT_EQ(store().list({}).value().jobs.size(), 1U);
  EXPECT_EQ(store().counts().value().queued, 0U);
  const auto events = store().events_after(before, "", 100).value();
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events.front().job_id, id);
  EXPECT_EQ(events.front().message, "2 ranges are given away");
  NewJob another = job();
  another.max_open = 2;
  EXPECT_TRUE(store().create(another)) << "one job is open";
}

TEST_P(StoreClaims, TheJournalOfAPartIsKept) {
  create();
  const Claim parent = claim();
  store().add_parts(parent.ref, two_parts(sha('d'))).value();
  clock_.now_ms += 1000;
  EXPECT_TRUE(store().forget_unused_blobs(Millis(500)).value().empty());
  EXPECT_TRUE(store().forget_parts(parent.ref));
  EXPECT_EQ(store().forget_unused_blobs(Millis(500)).value(), std::vector{sha('d')});
}

TEST_P(StoreClaims, AJobWaitsForMemoryAndSmallerOnesPassItForAWhile) {
  NewJob big = job("big"), small = job("small");
  big.memory_mb = 4096;
  small.memory_mb = 512;
  store().create(big).value();
  store().create(small).value();
  store().create(small).value();
  Taker busy{.free_mb = 1024, .idle = false, .patience = Millis(30'000)};
  EXPECT_EQ(store().claim(kTestLease, busy).value().value().job.label, "small");
  clock_.now_ms += 30'001;
  EXPECT_FALSE(store().claim(kTestLease, busy).value()) << "what gets free is for the one that has waited";
  busy.free_mb = 4096;
  EXPECT_EQ(store().claim(kTestLease, busy).value().value().job.label, "big");
  EXPECT_EQ(store().claim(kTestLease, busy).value().value().job.label, "small");
}

TEST_P(StoreClaims, APartThatHasNoRoomHoldsUpNobody) {
  NewJob big = job("big"), small = job("small");
  big.memory_mb = 4096;
  small.memory_mb = 512;
  big.tenant = "a";
  small.tenant = "b";
  for (const char* tenant : {"a", "b"}) EXPECT_TRUE(store().touch_blob(big.inputs.scene.sha256, 1, tenant));
  store().create(big).value();
  const Claim parent = claim();
  store().add_parts(parent.ref, two_parts(sha('d'))).value();
  for (int i = 0; i < 3; ++i) store().create(small).value();
  const Taker busy{.maker = "engine cpu", .free_mb = 1024, .idle = false};
  for (int i = 0; i < 3; ++i) {
    const auto next = store().claim(kTestLease, busy).value();
    ASSERT_TRUE(next) << "job " << i << ": its tenant has more at work than that of the part";
    EXPECT_EQ(next->job.label, "small");
    clock_.now_ms += 30'001;
  }
}

TEST_P(StoreClaims, AnIdleServerTakesAJobThatIsTooLargeForIt) {
  NewJob big = job();
  big.memory_mb = 1 << 20;
  store().create(big).value();
  EXPECT_FALSE(store().claim(kTestLease, {.free_mb = 1024, .idle = false}).value());
  EXPECT_TRUE(store().claim(kTestLease, {.free_mb = 1024, .idle = true}).value());
}

}  // namespace
}  // namespace kiln::testing
