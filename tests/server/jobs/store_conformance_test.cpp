#include "tests/server/jobs/store_conformance.h"

#include <algorithm>
#include <atomic>
#include <set>
#include <thread>

#include "server/jobs/sqlite_store.h"

namespace kiln::testing {

std::unique_ptr<JobStore> open_sqlite_on(const std::filesystem::path& folder, TestClock& clock) {
  return open_sqlite_store({folder / "kiln.db", [&clock] { return clock.now_ms; }}).value();
}

StoreConformance::StoreConformance() {
  std::string name = (std::filesystem::temp_directory_path() / "kiln_store.XXXXXX").string();
  folder_ = ::mkdtemp(name.data());
  GetParam().empty();
  store_ = GetParam().open(folder_, clock_);
  EXPECT_TRUE(store_->touch_blob(sha('a'), 100));
}

StoreConformance::~StoreConformance() {
  store_.reset();
  std::filesystem::remove_all(folder_);
}

void StoreConformance::reopen() {
  store_.reset();
  store_ = GetParam().open(folder_, clock_);
}

NewJob StoreConformance::job(const std::string& label, const std::string& content_key) {
  NewJob job;
  job.label = label;
  job.inputs.scene = {"scene.glb", sha('a')};
  job.recipe = "{}";
  job.content_key = content_key.empty() ? "key" + std::to_string(keys_++) : content_key;
  job.request_hash = "hash";
  return job;
}

namespace {

TEST_P(StoreConformance, AJobIsThereAfterItsStoreWasClosedAndOpenedAgain) {
  NewJob asked = job("night");
  EXPECT_TRUE(store().touch_blob(sha('b'), 5));
  asked.inputs.resources = {{"tex/wood.png", sha('b')}};
  asked.inputs.environment = NamedBlob{"sky.hdr", sha('b')};
  const Job made = store().create(asked).value().job;
  reopen();
  const Job job = store().get(made.id).value();
  EXPECT_EQ(job.state, JobState::queued);
  EXPECT_EQ(job.label, "night");
  EXPECT_EQ(job.inputs.scene, asked.inputs.scene);
  EXPECT_EQ(job.inputs.resources, asked.inputs.resources);
  EXPECT_EQ(job.inputs.environment, asked.inputs.environment);
  EXPECT_EQ(job.created_ms, clock_.now_ms);
}

TEST_P(StoreConformance, AJobNeedsAssetsThatTheStoreKnows) {
  NewJob asked = job();
  asked.inputs.resources = {{"missing.bin", sha('f')}};
  const auto created = store().create(asked);
  ASSERT_FALSE(created);
  EXPECT_EQ(created.error().code, "asset_not_found");
  EXPECT_EQ(created.error().where, sha('f'));
  EXPECT_EQ(store().counts()->queued, 0U) << "nothing of a refused job may stay";
}

TEST_P(StoreConformance, TheSameIdempotencyKeyAndRequestGiveTheFirstJob) {
  NewJob asked = job();
  asked.idempotency_key = "once";
  const auto first = store().create(asked).value();
  const auto second = store().create(asked).value();
  EXPECT_FALSE(first.existed);
  EXPECT_TRUE(second.existed);
  EXPECT_EQ(second.job.id, first.job.id);
  EXPECT_EQ(store().counts()->queued, 1U);
}

TEST_P(StoreConformance, AnIdempotencyKeyWithAnotherRequestIsRefused) {
  NewJob asked = job();
  asked.idempotency_key = "once";
  store().create(asked).value();
  asked.request_hash = "another";
  const auto second = store().create(asked);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, "idempotency_mismatch");
}

TEST_P(StoreConformance, AFullQueueRefusesTheNextJob) {
  NewJob asked = job();
  asked.max_queued = 2;
  store().create(asked).value();
  asked.content_key = "other";
  store().create(asked).value();
  asked.content_key = "third";
  const auto third = store().create(asked);
  ASSERT_FALSE(third);
  EXPECT_EQ(third.error().code, "queue_full");
}

TEST_P(StoreConformance, AKnownResultAnswersTheNextJobAtOnceUnlessForced) {
  const Job first = store().create(job("", "same")).value().job;
  const std::vector<Artifact> results{artifact(), artifact("report.json")};
  EXPECT_EQ(store().commit(claim().ref, results, false), Wrote::done);

  const Job second = store().create(job("", "same")).value().job;
  EXPECT_EQ(second.state, JobState::succeeded);
  EXPECT_TRUE(second.cached);
  ASSERT_EQ(second.artifacts.size(), 2U);
  EXPECT_EQ(second.artifacts[1].name, "report.json");
  EXPECT_EQ(second.artifacts[0].sha256, sha('e'));

  NewJob forced = job("", "same");
  forced.force = true;
  EXPECT_EQ(store().create(forced).value().job.state, JobState::queued);
}

TEST_P(StoreConformance, ContentThatCrashedItsWorkerIsRefusedForADayUnlessForced) {
  store().create(job("", "poison")).value();
  EXPECT_EQ(store().fail(claim().ref, {{"worker_crashed", "signal 11", ""}, 500}), Wrote::done);
  const auto again = store().create(job("", "poison"));
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, "poisoned");
  NewJob forced = job("", "poison");
  forced.force = true;
  EXPECT_TRUE(store().create(forced));
  clock_.now_ms += 24LL * 3600 * 1000 + 1;
  EXPECT_TRUE(store().create(job("", "poison")));
}

TEST_P(StoreConformance, PagesNeitherRepeatNorSkipWhileJobsAreCreated) {
  std::vector<std::string> made;
  for (int i = 0; i < 25; ++i) {
    clock_.now_ms += i % 3;  // several share a millisecond
    made.push_back(create().id);
  }
  std::vector<std::string> seen;
  JobQuery query;
  query.limit = 4;
  do {
    const JobPage page = store().list(query).value();
    for (const Job& job : page.jobs) seen.push_back(job.id);
    query.cursor = page.next_cursor;
    create();  // newer than every page that is still to come
  } while (!query.cursor.empty());
  std::ranges::reverse(made);
  EXPECT_EQ(seen, made);
}

TEST_P(StoreConformance, ListsFilterByStateAndLabel) {
  create("a");
  const std::string other = create("b").id;
  claim();
  JobQuery query;
  query.label = "b";
  ASSERT_EQ(store().list(query)->jobs.size(), 1U);
  EXPECT_EQ(store().list(query)->jobs[0].id, other);
  query.state = JobState::running;
  EXPECT_TRUE(store().list(query)->jobs.empty());
  query.label.reset();
  ASSERT_EQ(store().list(query)->jobs.size(), 1U);
  EXPECT_EQ(store().list(query)->jobs[0].label, "a");
}

TEST_P(StoreConformance, ACursorThatIsNotOursIsAFaultAndNotAnEmptyPage) {
  for (const char* cursor : {"x", "12", "12.", "12.short", "12'--.01ARZ3NDEKTSV4RRFFQ69G5FAV"}) {
    JobQuery query;
    query.cursor = cursor;
    const auto page = store().list(query);
    ASSERT_FALSE(page) << cursor;
    EXPECT_EQ(page.error().code, "bad_cursor");
  }
}

TEST_P(StoreConformance, EventsHaveGrowingIdsAndTellTheWholeStory) {
  const std::string id = create().id;
  store().commit(claim().ref, std::vector{artifact()}, false).value();
  const std::string other = create().id;
  std::vector<std::string> story;
  std::uint64_t last = 0;
  const auto events = store().events_after(0, id, 100).value();
  for (const JobEvent& event : events) {
    EXPECT_GT(event.id, last);
    EXPECT_EQ(event.job_id, id);
    last = event.id;
    story.push_back(std::string(to_string(event.kind)) + " " + std::string(to_string(event.state)));
  }
  EXPECT_EQ(story, (std::vector<std::string>{"state queued", "state running", "state succeeded", "artifact succeeded",
                                             "done succeeded"}));
  EXPECT_EQ(store().get(id)->version, last);
  const auto rest = store().events_after(last, "", 100).value();
  ASSERT_EQ(rest.size(), 1U);
  EXPECT_EQ(rest[0].job_id, other);
  EXPECT_EQ(store().last_event_id().value(), rest[0].id);
}

TEST_P(StoreConformance, AnArtifactEventCarriesItsArtifact) {
  create();
  store().commit(claim().ref, std::vector{artifact("preview.png")}, false).value();
  const auto events = store().events_after(0, "", 100).value();
  for (const JobEvent& event : events) {
    EXPECT_EQ(event.artifact.has_value(), event.kind == EventKind::artifact);
    EXPECT_EQ(event.artifact.value_or(artifact("preview.png")).name, "preview.png");
  }
}

TEST_P(StoreConformance, OnlyTerminalJobsCanBeRemovedAndRemovingTwiceIsFine) {
  const std::string id = create().id;
  EXPECT_EQ(store().remove(id).error().code, "not_terminal");
  store().cancel(id).value();
  EXPECT_TRUE(store().remove(id));
  EXPECT_EQ(store().get(id).error().code, "not_found");
  EXPECT_TRUE(store().remove(id));
  EXPECT_TRUE(store().events_after(0, id, 10)->empty());
}

TEST_P(StoreConformance, UnusedBlobsAreForgottenAfterTheirGraceAndUsedOnesNever) {
  EXPECT_TRUE(store().touch_blob(sha('d'), 7));
  const std::string id = create().id;
  store().commit(claim().ref, std::vector{artifact()}, false).value();
  EXPECT_TRUE(store().forget_unused_blobs(Millis(1000))->empty());
  clock_.now_ms += 1001;
  EXPECT_EQ(store().forget_unused_blobs(Millis(1000)).value(), std::vector{sha('d')});
  EXPECT_FALSE(store().knows_blob(sha('d')).value());
  EXPECT_TRUE(store().remove(id));
  clock_.now_ms += 1001;
  const auto freed = store().forget_unused_blobs(Millis(1000)).value();
  EXPECT_EQ(std::set(freed.begin(), freed.end()), (std::set{sha('a'), sha('e')}));
}

TEST_P(StoreConformance, AReferenceRenewsTheGraceOfItsBlob) {
  clock_.now_ms += 5000;
  const std::string id = create().id;
  store().cancel(id).value();
  EXPECT_TRUE(store().remove(id));
  EXPECT_TRUE(store().forget_unused_blobs(Millis(1000))->empty());
}

TEST_P(StoreConformance, CountsFollowTheStates) {
  const std::string first = create().id;
  clock_.now_ms += 10;
  create();
  store().cancel(first).value();
  clock_.now_ms += 10;
  const Claim running = claim();
  create();
  const StoreCounts counts = store().counts().value();
  EXPECT_EQ(counts.queued, 1U);
  EXPECT_EQ(counts.running, 1U);
  EXPECT_EQ(counts.canceled, 1U);
  EXPECT_EQ(counts.oldest_queued_ms, clock_.now_ms);
}

TEST_P(StoreConformance, ATenantsAssetsKeysAndListAreItsOwn) {
  NewJob ours = job("ours", "key a"), theirs = job("theirs", "key b");
  ours.tenant = "a";
  theirs.tenant = "b";
  ours.idempotency_key = theirs.idempotency_key = "once";
  EXPECT_EQ(store().create(ours).error().code, "asset_not_found") << "the scene is nobody's of a";
  EXPECT_TRUE(store().touch_blob(sha('a'), 100, "a"));
  EXPECT_TRUE(store().knows_blob(sha('a'), "a").value());
  EXPECT_FALSE(store().knows_blob(sha('a'), "b").value());
  EXPECT_TRUE(store().knows_blob(sha('a')).value());
  EXPECT_TRUE(store().touch_blob(sha('a'), 100, "b"));
  const std::string id = store().create(ours).value().job.id;
  EXPECT_FALSE(store().create(theirs).value().existed) << "the same key of another tenant is another key";
  EXPECT_TRUE(store().create(ours).value().existed);
  EXPECT_EQ(store().get(id)->tenant, "a");
  JobQuery query;
  query.tenant = "a";
  ASSERT_EQ(store().list(query)->jobs.size(), 1U);
  EXPECT_EQ(store().list(query)->jobs[0].id, id);
  store().commit(claim().ref, std::vector{artifact()}, false).value();
  EXPECT_TRUE(store().knows_blob(sha('e'), "a").value()) << "what a tenant baked is its own";
  EXPECT_FALSE(store().knows_blob(sha('e'), "b").value());
}

TEST_P(StoreConformance, ATenantHasSoManyUnfinishedJobsAndAnotherIsNotHeldUp) {
  for (const char* tenant : {"a", "b"}) EXPECT_TRUE(store().touch_blob(sha('a'), 100, tenant));
  const auto submit = [&](const std::string& tenant) {
    NewJob asked = job();
    asked.tenant = tenant;
    asked.max_open = 2;
    return store().create(asked);
  };
  EXPECT_TRUE(submit("a"));
  claim();  // a running job counts as well
  EXPECT_TRUE(submit("a"));
  EXPECT_EQ(submit("a").error().code, "quota");
  EXPECT_TRUE(submit("b"));
}

TEST_P(StoreConformance, TheTenantWithTheFewestRunningJobsIsNext) {
  for (const char* tenant : {"a", "b"}) EXPECT_TRUE(store().touch_blob(sha('a'), 100, tenant));
  const auto submit = [&](const std::string& tenant) {
    NewJob asked = job();
    asked.tenant = tenant;
    EXPECT_TRUE(store().create(asked));
  };
  for (int i = 0; i < 3; ++i) submit("a");
  for (int i = 0; i < 2; ++i) submit("b");
  std::string order;
  for (int i = 0; i < 5; ++i) order += claim().job.tenant;
  EXPECT_EQ(order, "ababa");
}

TEST_P(StoreConformance, AStoreIsTheSameForEver) {
  const std::string identity = store().identity().value();
  EXPECT_EQ(identity.size(), 32U);
  EXPECT_EQ(identity.find_first_not_of("0123456789abcdef"), std::string::npos) << identity;
  reopen();
  EXPECT_EQ(store().identity().value(), identity);
}

TEST_P(StoreConformance, TheBlobGateLetsManyInAndThenOneAlone) {
  auto first = store().enter_blob_gate();
  auto second = store().enter_blob_gate();
  EXPECT_TRUE(first && second);
  first->reset();
  second->reset();
  EXPECT_TRUE(store().close_blob_gate());
  EXPECT_TRUE(store().enter_blob_gate()) << "a gate opens again at the end of its holder";
}

TEST_P(StoreConformance, NobodyMakesABlobWhileOneIsAloneAtTheGate) {
  auto alone = store().close_blob_gate();
  ASSERT_TRUE(alone);
  std::atomic<bool> inside{false};
  std::thread other([&] {
    const auto gate = store().enter_blob_gate();
    inside = gate.has_value();
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(100));  // a gate that does not hold lets it in by now
  EXPECT_FALSE(inside);
  alone->reset();
  other.join();
  EXPECT_TRUE(inside);
}

TEST_P(StoreConformance, TextsOfAllAlphabetsAndNumbersOfAllSizesComeBack) {
  NewJob asked = job("Gl\xC3\xBChofen \xE7\xAA\xAF '?$1\\ \"x\"");
  asked.recipe = R"({"a": "?", "b": "'"})";
  const std::string id = store().create(asked).value().job.id;
  const JobProgress progress{"stage", 3'000'000'000'000, 4'000'000'000'000, 1.0 / 3, 0.1};
  EXPECT_EQ(store().heartbeat(claim().ref, kTestLease, progress), Beat::ok);
  const Job read = store().get(id).value();
  EXPECT_EQ(read.label, asked.label);
  EXPECT_EQ(read.recipe, asked.recipe);
  EXPECT_EQ(read.progress->done, progress.done);
  EXPECT_EQ(read.progress->fraction, progress.fraction);
  EXPECT_EQ(read.progress->eta_s, progress.eta_s);
}

}  // namespace

}  // namespace kiln::testing
