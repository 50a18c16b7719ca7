// One tenant sees nothing of another: jobs, assets, events, keys.

#include "server/work/tenant_service.h"

#include "core/base/sha256.h"
#include "tests/server/work/service_fixture.h"

namespace kiln::testing {
namespace {

class TenantTest : public ServiceTest {
 protected:
  TenantTest() : a_(start(), "a", 2), b_(*service_, "b", 0) {}

  static StoredBlob stored_for(Service& service, const std::string& text) {
    auto upload = service.put_asset({}).value();
    EXPECT_TRUE(upload->write({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}));
    return upload->finish().value();
  }
  static std::string put_for(Service& service, const std::string& text) { return stored_for(service, text).sha256; }
  Submission scene_of(Service& service, const std::string& label) {
    Submission job;
    job.scene_sha256 = put_for(service, "the scene");
    job.recipe.steps = {PrtStep{}};
    job.recipe.label = label;
    return job;
  }

  TenantService a_, b_;
};

TEST_F(TenantTest, AnothersJobIsNotFoundWhateverIsAskedOfIt) {
  const std::string id = a_.submit(scene_of(a_, "ok"))->job.id;
  ASSERT_EQ(a_.wait_done(id, 20s)->state, JobState::succeeded);
  const std::string name = a_.get(id)->artifacts.at(0).name;
  EXPECT_TRUE(a_.open_artifact(id, name));
  EXPECT_EQ(b_.get(id).error().code, "not_found");
  EXPECT_EQ(b_.cancel(id).error().code, "not_found");
  EXPECT_EQ(b_.remove(id).error().code, "not_found");
  EXPECT_EQ(b_.wait_done(id, 0ms).error().code, "not_found");
  EXPECT_EQ(b_.wait_change(id, 0, 0ms).error().code, "not_found");
  EXPECT_EQ(b_.subscribe(id, 0).error().code, "not_found");
  EXPECT_EQ(b_.open_artifact(id, name).error().code, "not_found");
  EXPECT_TRUE(b_.list({})->jobs.empty());
  EXPECT_EQ(a_.list({})->jobs.size(), 1U);
  EXPECT_EQ(service_->list({})->jobs.size(), 1U) << "the one who sees all sees it";
}

TEST_F(TenantTest, AnothersAssetCannotBeReadUsedOrSeenToBeThere) {
  const std::string sha256 = put_for(a_, "a secret scene");
  EXPECT_TRUE(a_.has_asset(sha256, {}));
  EXPECT_FALSE(b_.has_asset(sha256, {}));
  EXPECT_FALSE(b_.open_asset(sha256));
  Submission stolen = scene_of(b_, "ok");
  stolen.scene_sha256 = sha256;
  EXPECT_EQ(b_.submit(stolen).error().code, "asset_not_found");
  EXPECT_EQ(b_.plan(stolen).error().code, "asset_not_found");
}

TEST_F(TenantTest, WhoUploadsWhatAnotherHasIsNotTold) {
  EXPECT_FALSE(stored_for(a_, "a secret scene").existed);
  EXPECT_FALSE(stored_for(b_, "a secret scene").existed);
  EXPECT_TRUE(stored_for(b_, "a secret scene").existed) << "its own";
}

TEST_F(TenantTest, WhoSeesAllFindsAnAssetAndBakesItWithoutHandingItOutByLooking) {
  const std::string sha256 = put_for(a_, "a secret scene");
  TenantService nobody(*service_, "", 0);
  EXPECT_TRUE(service_->has_asset(sha256, std::nullopt));
  EXPECT_FALSE(nobody.has_asset(sha256, std::nullopt)) << "looking gives it to nobody";
  EXPECT_FALSE(nobody.open_asset(sha256));
  Submission job = scene_of(a_, "ok");
  job.scene_sha256 = sha256;
  EXPECT_EQ(nobody.submit(job).error().code, "asset_not_found");
  job.tenant.reset();
  EXPECT_TRUE(service_->plan(job));
  const auto baked = service_->submit(job);
  ASSERT_TRUE(baked) << baked.error().code;
  EXPECT_EQ(service_->wait_done(baked->job.id, 20s)->state, JobState::succeeded);
  EXPECT_TRUE(nobody.has_asset(sha256, std::nullopt)) << "a bake does";
}

TEST_F(TenantTest, AnothersHalfOfANamedUploadIsNeitherSeenNorGoneOnWithNorInTheWay) {
  const std::string text = "a secret scene that ends in zeros 0000";
  const auto bytes = [&](std::size_t from, std::size_t count) {
    return std::span(reinterpret_cast<const std::uint8_t*>(text.data()) + from, count);
  };
  const std::size_t half = text.size() - 4;
  const std::string sha256 = sha256_hex(bytes(0, text.size()));
  ASSERT_TRUE(a_.put_asset({sha256, 0, half}).value()->write(bytes(0, half)));
  EXPECT_EQ(b_.asset_offset(sha256, ""), 0U);
  EXPECT_EQ(b_.put_asset({sha256, half, 4}).error().code, "offset_mismatch");
  { ASSERT_TRUE(b_.put_asset({sha256, 0, 5}).value()->write(bytes(0, 5))); }
  EXPECT_EQ(b_.asset_offset(sha256, ""), 5U);
  EXPECT_EQ(a_.asset_offset(sha256, ""), half);
  auto rest = a_.put_asset({sha256, half, 4}).value();
  ASSERT_TRUE(rest->write(bytes(half, 4)));
  EXPECT_EQ(rest->finish()->sha256, sha256);
  EXPECT_FALSE(b_.open_asset(sha256));
}

TEST_F(TenantTest, TheSameSceneAndRecipeIsBakedForEachAndAnsweredFromTheOwnResult) {
  const std::string first = a_.submit(scene_of(a_, "ok"))->job.id;
  ASSERT_EQ(a_.wait_done(first, 20s)->state, JobState::succeeded);
  EXPECT_FALSE(b_.submit(scene_of(b_, "ok"))->job.cached) << "it would tell that somebody baked it";
  EXPECT_TRUE(a_.submit(scene_of(a_, "ok"))->job.cached);
}

TEST_F(TenantTest, AStreamOfAllEventsHoldsOnlyTheTenants) {
  auto stream = b_.subscribe("", 0).value();
  a_.submit(scene_of(a_, "ok")).value();
  const std::string own = b_.submit(scene_of(b_, "ok"))->job.id;
  ASSERT_EQ(b_.wait_done(own, 20s)->state, JobState::succeeded);
  int events = 0;
  while (const auto event = stream->next(200ms)) {
    EXPECT_EQ(event->job_id, own);
    ++events;
  }
  EXPECT_GE(events, 4);
}

TEST_F(TenantTest, AQuotaOfJobsHoldsForOneTenantAlone) {
  for (int i = 0; i < 2; ++i) {
    Submission job = scene_of(a_, "hang");
    job.recipe.seed = static_cast<std::uint64_t>(i);
    EXPECT_TRUE(a_.submit(job));
  }
  Submission third = scene_of(a_, "hang");
  third.recipe.seed = 9;
  EXPECT_EQ(a_.submit(third).error().code, "quota");
  EXPECT_TRUE(b_.submit(scene_of(b_, "ok")));
}

}  // namespace
}  // namespace kiln::testing
