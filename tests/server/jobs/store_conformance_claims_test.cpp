// Claims, leases, fences: the part of the suite that keeps results exactly-once.

#include <algorithm>
#include <atomic>
#include <mutex>
#include <set>
#include <thread>

#include "tests/server/jobs/store_conformance.h"

namespace kiln::testing {

namespace {

TEST_P(StoreClaims, TheOldestDueJobIsClaimedFirstAndOnlyOnce) {
  const std::string first = create().id;
  const std::string second = create().id;
  EXPECT_EQ(claim().ref.job_id, first);
  EXPECT_EQ(claim().ref.job_id, second);
  EXPECT_FALSE(store().claim(kTestLease, {}).value());
}

TEST_P(StoreClaims, TokensDifferAndFencesGrow) {
  create();
  create();
  const Claim a = claim(), b = claim();
  EXPECT_NE(a.ref.token, b.ref.token);
  EXPECT_EQ(a.ref.token.size(), 32U);
  EXPECT_GT(b.ref.fence, a.ref.fence);
  EXPECT_EQ(a.job.attempt, 1);
}

TEST_P(StoreClaims, ManyThreadsNeverClaimTheSameJob) {
  constexpr int kJobs = 40;
  for (int i = 0; i < kJobs; ++i) create();
  std::mutex mutex;
  std::vector<std::string> claimed;
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&] {
      while (auto claim = store().claim(kTestLease, {}).value()) {
        const std::lock_guard lock(mutex);
        claimed.push_back(claim->ref.job_id);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  std::ranges::sort(claimed);
  EXPECT_EQ(claimed.size(), static_cast<std::size_t>(kJobs));
  EXPECT_EQ(std::ranges::adjacent_find(claimed), claimed.end());
}

TEST_P(StoreClaims, AnEndedLeaseIsReapedAndTheOldWorkerIsFencedOff) {
  const std::string id = create().id;
  const Claim lost = claim();
  EXPECT_EQ(store().reap().value(), 0);
  clock_.now_ms += kTestLease.count() + 1;
  EXPECT_EQ(store().reap().value(), 1);
  EXPECT_EQ(state_of(id), JobState::queued);
  const Claim next = claim();
  EXPECT_EQ(next.job.attempt, 2);

  EXPECT_EQ(store().heartbeat(lost.ref, kTestLease, {}), Beat::lost);
  EXPECT_EQ(store().commit(lost.ref, std::vector{artifact("stale.glb")}, false), Wrote::lost);
  EXPECT_EQ(store().fail(lost.ref, {{"x", "x", ""}, 500}), Wrote::lost);
  EXPECT_EQ(store().release(lost.ref), Wrote::lost);
  EXPECT_EQ(store().retry(lost.ref, {"x"}), Wrote::lost);
  EXPECT_EQ(store().finish_cancel(lost.ref), Wrote::lost);
  EXPECT_EQ(state_of(id), JobState::running);

  EXPECT_EQ(store().commit(next.ref, std::vector{artifact()}, false), Wrote::done);
  ASSERT_EQ(store().get(id)->artifacts.size(), 1U);
  EXPECT_EQ(store().get(id)->artifacts[0].name, "scene.glb");
}

TEST_P(StoreClaims, TheStoryTellsWhyAJobRanMoreThanOnce) {
  const std::string id = create().id;
  claim();
  clock_.now_ms += kTestLease.count() + 1;
  ASSERT_EQ(store().reap().value(), 1);
  store().retry(claim().ref, {"its worker was ended by signal 9", true, Millis(0)}).value();
  claim();
  ASSERT_EQ(store().reap(true).value(), 1);
  store().release(claim().ref).value();
  store().commit(claim().ref, std::vector{artifact()}, false).value();
  std::vector<std::string> told;
  const auto story = store().events_after(0, id, 100).value();
  for (const JobEvent& event : story) {
    if (event.kind == EventKind::state) told.push_back(std::string(to_string(event.state)) + ": " + event.message);
  }
  EXPECT_EQ(told, (std::vector<std::string>{
                      "queued: ", "running: attempt 1", "queued: its lease ended without a word of its server",
                      "running: attempt 2", "queued: its worker was ended by signal 9", "running: attempt 3",
                      "queued: its server ended before it was done", "running: attempt 4",
                      "queued: the server stops; the job goes on after its next start", "running: attempt 4",
                      "succeeded: "}));
}

TEST_P(StoreClaims, TheRightTokenWithAWrongFenceIsFencedOffToo) {
  create();
  ClaimRef forged = claim().ref;
  ++forged.fence;
  EXPECT_EQ(store().commit(forged, std::vector{artifact()}, false), Wrote::lost);
}

TEST_P(StoreClaims, AHeartbeatKeepsTheLeaseAndTheProgress) {
  const std::string id = create().id;
  const Claim mine = claim();
  clock_.now_ms += kTestLease.count() - 1;
  JobProgress progress{"transfer", 3, 10, 0.25, 7.5};
  EXPECT_EQ(store().heartbeat(mine.ref, kTestLease, progress), Beat::ok);
  clock_.now_ms += kTestLease.count() - 1;
  EXPECT_EQ(store().reap().value(), 0);
  const Job job = store().get(id).value();
  ASSERT_TRUE(job.progress);
  EXPECT_EQ(job.progress->stage, "transfer");
  EXPECT_EQ(job.progress->done, 3U);
  EXPECT_EQ(job.progress->eta_s, 7.5);
}

TEST_P(StoreClaims, ACommitThatIsRepeatedBecauseItsAnswerGotLostIsDone) {
  const std::string id = create().id;
  const Claim mine = claim();
  EXPECT_EQ(store().commit(mine.ref, std::vector{artifact()}, false), Wrote::done);
  EXPECT_EQ(store().commit(mine.ref, std::vector{artifact()}, false), Wrote::done);
  EXPECT_EQ(store().get(id)->artifacts.size(), 1U);
  EXPECT_EQ(store().events_after(0, id, 100)->size(), 5U) << "and told once";
}

TEST_P(StoreClaims, OneOfManyCommitsUnderOneClaimMakesTheResult) {
  const std::string id = create().id;
  const Claim mine = claim();
  std::vector<std::thread> threads;
  std::atomic<int> done{0};
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&] { done += store().commit(mine.ref, std::vector{artifact()}, false) == Wrote::done; });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(done, 4);
  EXPECT_EQ(store().get(id)->artifacts.size(), 1U);
}

TEST_P(StoreClaims, CancelAndCommitAtTheSameMomentLeaveOneOfTheTwo) {
  for (int round = 0; round < 10; ++round) {
    const std::string id = create().id;
    const Claim mine = claim();
    std::thread canceler([&] { EXPECT_TRUE(store().cancel(id)); });
    const Wrote wrote = store().commit(mine.ref, std::vector{artifact()}, false).value();
    canceler.join();
    if (wrote == Wrote::lost) {
      EXPECT_EQ(store().finish_cancel(mine.ref), Wrote::done);
    }
    const Job job = store().get(id).value();
    EXPECT_EQ(job.state, wrote == Wrote::done ? JobState::succeeded : JobState::canceled);
    EXPECT_EQ(job.artifacts.empty(), wrote == Wrote::lost);
  }
}

TEST_P(StoreClaims, AReaderOfEventsMissesNoneOfManyWriters) {
  constexpr int kEach = 20;
  std::vector<std::thread> writers;
  for (int i = 0; i < 4; ++i) {
    writers.emplace_back([&] {
      NewJob asked = job();
      for (int n = 0; n < kEach; ++n) EXPECT_TRUE(store().create(asked));
    });
  }
  std::set<std::uint64_t> seen;
  std::uint64_t last = 0;
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (seen.size() < 4 * kEach && std::chrono::steady_clock::now() < deadline) {
    const auto page = store().events_after(last, "", 7).value();
    for (const JobEvent& event : page) {
      last = event.id;
      seen.insert(event.id);
    }
  }
  for (std::thread& writer : writers) writer.join();
  EXPECT_EQ(seen.size(), 4U * kEach);
  EXPECT_TRUE(store().events_after(last, "", 7)->empty());
}

TEST_P(StoreClaims, CancelBeatsACommitThatComesAfterIt) {
  const std::string id = create().id;
  const Claim mine = claim();
  EXPECT_EQ(store().cancel(id)->state, JobState::running);
  EXPECT_EQ(store().heartbeat(mine.ref, kTestLease, {}), Beat::cancel_requested);
  EXPECT_EQ(store().commit(mine.ref, std::vector{artifact()}, false), Wrote::lost);
  EXPECT_EQ(store().finish_cancel(mine.ref), Wrote::done);
  const Job job = store().get(id).value();
  EXPECT_EQ(job.state, JobState::canceled);
  EXPECT_TRUE(job.artifacts.empty());
  EXPECT_GT(job.finished_ms, 0);
}

TEST_P(StoreClaims, ACommitThatComesBeforeTheCancelStands) {
  const std::string id = create().id;
  store().commit(claim().ref, std::vector{artifact()}, false).value();
  EXPECT_EQ(store().cancel(id)->state, JobState::succeeded);
}

TEST_P(StoreClaims, AQueuedJobIsCanceledAtOnceAndTwiceIsFine) {
  const std::string id = create().id;
  EXPECT_EQ(store().cancel(id)->state, JobState::canceled);
  EXPECT_EQ(store().cancel(id)->state, JobState::canceled);
  EXPECT_FALSE(store().claim(kTestLease, {}).value());
  EXPECT_EQ(store().cancel("01ARZ3NDEKTSV4RRFFQ69G5FAV").error().code, "not_found");
}

TEST_P(StoreClaims, ARunningJobWhoseCancelWasAskedForIsCanceledWhenItsWorkerIsLost) {
  const std::string id = create().id;
  claim();
  store().cancel(id).value();
  EXPECT_EQ(store().reap(true).value(), 1);
  EXPECT_EQ(state_of(id), JobState::canceled);
}

TEST_P(StoreClaims, ReleaseGivesTheAttemptBack) {
  create();
  EXPECT_EQ(store().release(claim().ref), Wrote::done);
  EXPECT_EQ(claim().job.attempt, 1);
}

TEST_P(StoreClaims, ARetryWaitsForItsTimeAndCountsItsKind) {
  const std::string id = create().id;
  EXPECT_EQ(store().retry(claim().ref, {"disk full", false, Millis(500)}), Wrote::done);
  EXPECT_FALSE(store().claim(kTestLease, {}).value());
  EXPECT_EQ(store().next_due().value(), Millis(500));
  clock_.now_ms += 500;
  const Claim again = claim();
  EXPECT_EQ(again.job.retries, 1);
  EXPECT_EQ(again.job.crashes, 0);
  EXPECT_EQ(again.job.attempt, 2);
  EXPECT_EQ(store().retry(again.ref, {"signal 11", true}), Wrote::done);
  EXPECT_EQ(store().get(id)->crashes, 1);
}

TEST_P(StoreClaims, AFailureKeepsItsReason) {
  const std::string id = create().id;
  const JobError error{{"non_finite_geometry", "a position is not a number", "scene.glb: /accessors/0"}, 422};
  EXPECT_EQ(store().fail(claim().ref, error), Wrote::done);
  const Job job = store().get(id).value();
  EXPECT_EQ(job.state, JobState::failed);
  ASSERT_TRUE(job.error);
  EXPECT_EQ(job.error->fault.code, error.fault.code);
  EXPECT_EQ(job.error->fault.message, error.fault.message);
  EXPECT_EQ(job.error->fault.where, error.fault.where);
  EXPECT_EQ(job.error->status, 422);
}

TEST_P(StoreClaims, ARestartPutsEveryRunningJobBackAtOnce) {
  const std::string id = create().id;
  const Claim lost = claim();
  reopen();
  EXPECT_EQ(store().reap(true).value(), 1);
  EXPECT_EQ(state_of(id), JobState::queued);
  EXPECT_EQ(store().commit(lost.ref, std::vector{artifact()}, false), Wrote::lost);
}

}  // namespace

}  // namespace kiln::testing
