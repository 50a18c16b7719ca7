// What is kept and for how long, in every engine: retention, pins, and what a tenant uploads a day.

#include <algorithm>

#include "tests/server/jobs/store_conformance.h"

namespace kiln::testing {
namespace {

constexpr Millis kDay{24 * 3600 * 1000};

/// "" for a success: engines with a flaw have some where there should be none.
template <class T>
std::string code_of(const Result<T>& result) {
  return result ? "" : result.error().code;
}

TEST_P(StoreConformance, AJobOlderThanItsTenantKeepsItIsForgottenAndWhatItHeldBecomesUnused) {
  const auto ended = [&](const std::string& tenant) {
    EXPECT_TRUE(store().touch_blob(sha('a'), 1, tenant));
    NewJob wanted = job();
    wanted.tenant = tenant;
    std::string id = store().create(wanted).value().job.id;
    EXPECT_EQ(store().cancel(id)->state, JobState::canceled);
    return id;
  };
  const std::string brief = ended("brief"), other = ended("other"), endless = ended("endless");
  const std::string running = create().id;
  claim();
  const Retention rules{kDay * 10, {{"brief", kDay}, {"endless", Millis(0)}}};
  EXPECT_EQ(store().forget_old_jobs(rules).value(), 0);
  clock_.now_ms += kDay.count() + 1;
  EXPECT_EQ(store().forget_old_jobs(rules, true).value(), 1) << "counted";
  EXPECT_TRUE(store().get(brief)) << "and not forgotten";
  EXPECT_EQ(store().forget_old_jobs(rules).value(), 1);
  EXPECT_EQ(code_of(store().get(brief)), "not_found");
  EXPECT_TRUE(store().events_after(0, brief, 10)->empty());
  clock_.now_ms += 10 * kDay.count();
  EXPECT_EQ(store().forget_old_jobs(rules).value(), 1);
  EXPECT_EQ(code_of(store().get(other)), "not_found");
  EXPECT_TRUE(store().get(endless));
  EXPECT_TRUE(store().get(running)) << "what has not ended has no age";
  EXPECT_EQ(store().forget_old_jobs({}).value(), 0) << "without rules everything is kept";
}

TEST_P(StoreConformance, APinnedJobIsKeptWithAllItsBlobsUntilItIsUnpinned) {
  const std::string id = create().id;
  store().commit(claim().ref, std::vector{artifact()}, false).value();
  const std::uint64_t version = store().get(id)->version;
  EXPECT_TRUE(store().pin(id, true).value().pinned);
  EXPECT_TRUE(store().get(id).value().pinned);
  EXPECT_GT(store().get(id)->version, version) << "watchers see it";
  EXPECT_EQ(store().counts()->pinned, 1U);
  EXPECT_EQ(code_of(store().pin("01ARZ3NDEKTSV4RRFFQ69G5FAV", true)), "not_found");
  clock_.now_ms += 100 * kDay.count();
  EXPECT_EQ(store().forget_old_jobs({kDay, {}}).value(), 0);
  EXPECT_EQ(code_of(store().remove(id)), "pinned");
  EXPECT_TRUE(store().forget_unused_blobs(kDay)->empty());
  const auto unpinned = store().pin(id, false);
  EXPECT_TRUE(unpinned && !unpinned->pinned);
  EXPECT_EQ(store().forget_old_jobs({kDay, {}}).value(), 1);
  EXPECT_EQ(store().forget_unused_blobs(kDay, true)->size(), 2U) << "counted";
  EXPECT_EQ(store().forget_unused_blobs(kDay)->size(), 2U);
}

TEST_P(StoreConformance, APinnedBlobIsKeptWithoutAJobAndEachTenantHasItsOwnPin) {
  EXPECT_TRUE(store().touch_blob(sha('d'), 7, "ours"));
  EXPECT_TRUE(store().touch_blob(sha('d'), 7, "theirs"));
  const auto forgotten = [&] {
    clock_.now_ms += kDay.count() + 1;
    return std::ranges::count(store().forget_unused_blobs(kDay).value(), sha('d')) == 1;
  };
  EXPECT_EQ(code_of(store().pin_blob(sha('d'), "nobody", true)), "not_found");
  EXPECT_TRUE(store().pin_blob(sha('d'), "ours", true));
  EXPECT_TRUE(store().pin_blob(sha('d'), "theirs", true));
  EXPECT_FALSE(forgotten());
  EXPECT_TRUE(store().pin_blob(sha('d'), "theirs", false));
  EXPECT_FALSE(forgotten());
  EXPECT_TRUE(store().knows_blob(sha('d'), "ours").value());
  EXPECT_TRUE(store().pin_blob(sha('d'), "ours", false));
  EXPECT_TRUE(forgotten());
}

TEST_P(StoreConformance, ABlobThatIsTouchedForNobodyIsKeptAndNobodyHasIt) {
  EXPECT_TRUE(store().touch_blob(sha('d'), 7, "ours"));
  clock_.now_ms += kDay.count() + 1;
  EXPECT_TRUE(store().touch_blob(sha('d'), 7, std::nullopt));
  EXPECT_EQ(std::ranges::count(store().forget_unused_blobs(kDay).value(), sha('d')), 0);
  EXPECT_FALSE(store().knows_blob(sha('d'), "").value());
  EXPECT_TRUE(store().knows_blob(sha('d'), "ours").value());
}

TEST_P(StoreConformance, ATenantUploadsSoMuchADayAndAnotherIsNotHeldUp) {
  clock_.now_ms = 20'000 * kDay.count() + 1000;
  const std::int64_t day = store().charge_upload("busy", 60, 100).value();
  EXPECT_TRUE(store().charge_upload("busy", 40, 100)) << "all of it may be used";
  EXPECT_EQ(code_of(store().charge_upload("busy", 1, 100)), "daily_quota");
  EXPECT_TRUE(store().charge_upload("calm", 100, 100));
  EXPECT_TRUE(store().refund_upload("busy", 30, day)) << "that did not come";
  EXPECT_EQ(code_of(store().charge_upload("busy", 31, 100)), "daily_quota") << "and what was refused is not counted";
  EXPECT_TRUE(store().charge_upload("busy", 30, 100));
  clock_.now_ms += kDay.count();
  EXPECT_TRUE(store().charge_upload("busy", 100, 100)) << "the next day";
  EXPECT_TRUE(store().refund_upload("busy", 100, day));
  EXPECT_EQ(code_of(store().charge_upload("busy", 1, 100)), "daily_quota")
      << "what was charged yesterday is yesterday's";
  EXPECT_TRUE(store().refund_upload("busy", 1000, day + 1)) << "never below nothing";
  EXPECT_TRUE(store().charge_upload("busy", 100, 100));
  EXPECT_EQ(code_of(store().charge_upload("busy", 1, 100)), "daily_quota");
  EXPECT_TRUE(store().charge_upload("busy", 1'000'000'000'000, 0)) << "0: no limit";
}

}  // namespace
}  // namespace kiln::testing
