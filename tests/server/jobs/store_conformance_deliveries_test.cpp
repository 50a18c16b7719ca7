// Messages wait in the store until they are delivered, through restarts, and never with two senders at once.
#include "server/jobs/delivery.h"
#include "tests/server/jobs/store_conformance.h"

namespace kiln::testing {
namespace {

constexpr Millis kLease{30'000}, kLongest{3'600'000};

NewDelivery delivery(const std::string& message, const std::string& receiver = "https://a/") {
  return {message, receiver, "{\"id\":\"" + message + "\"}"};
}

/// As if the events up to the newest had been looked through.
void add(JobStore& store, std::vector<NewDelivery> all) {
  const DeliveryMark mark = store.deliveries().mark().value();
  ASSERT_EQ(store.deliveries().add(mark.event, mark.event + 1, all, kLongest).value(), Wrote::done);
}

std::string taken(JobStore& store, const std::string& receiver = "https://a/") {
  const auto one = store.deliveries().take(receiver, kLease).value();
  return one ? one->message : "";
}

TEST_P(StoreDeliveries, TheFirstMarkIsTheNewestEvent) {
  create();
  const std::uint64_t newest = store().last_event_id().value();
  EXPECT_EQ(store().deliveries().mark().value().event, newest);
  create();
  EXPECT_EQ(store().deliveries().mark().value().event, newest) << "it moves with add() alone";
}

TEST_P(StoreDeliveries, OneOfTwoWhoLookedThroughTheSameEventsAddsThem) {
  const std::uint64_t from = store().deliveries().mark().value().event;
  const std::vector<NewDelivery> all{delivery("m1")};
  EXPECT_EQ(store().deliveries().add(from, from + 5, all, kLongest).value(), Wrote::done);
  EXPECT_EQ(store().deliveries().add(from, from + 5, all, kLongest).value(), Wrote::lost);
  EXPECT_EQ(store().deliveries().mark().value().event, from + 5);
  EXPECT_EQ(taken(store()), "m1");
  EXPECT_EQ(taken(store()), "");
}

TEST_P(StoreDeliveries, WhatIsTakenIsNobodyElsesUntilItsLeaseEnds) {
  add(store(), {delivery("m1"), delivery("m2")});
  EXPECT_EQ(taken(store()), "m1");
  EXPECT_EQ(taken(store()), "m2");
  EXPECT_EQ(taken(store()), "");
  clock_.now_ms += kLease.count();
  const auto again = store().deliveries().take("https://a/", kLease).value();
  ASSERT_TRUE(again);
  EXPECT_EQ(again->message, "m1");
  EXPECT_EQ(again->attempt, 2);
  EXPECT_EQ(again->age, kLease);
  EXPECT_EQ(again->body, "{\"id\":\"m1\"}");
}

TEST_P(StoreDeliveries, AReceiverTakesItsOwn) {
  add(store(), {delivery("m1", "https://a/"), delivery("m1", "https://b/")});
  EXPECT_EQ(taken(store(), "https://b/"), "m1");
  EXPECT_EQ(taken(store(), "https://b/"), "");
  EXPECT_EQ(taken(store(), "https://a/"), "m1");
}

TEST_P(StoreDeliveries, ARetryRestsAndAFinishedOneIsGone) {
  add(store(), {delivery("m1")});
  auto one = store().deliveries().take("https://a/", kLease).value().value();
  ASSERT_TRUE(store().deliveries().retry(one, Millis(5000)));
  clock_.now_ms += 4999;
  EXPECT_EQ(taken(store()), "");
  clock_.now_ms += 1;
  EXPECT_EQ(taken(store()), "m1");
  ASSERT_TRUE(store().deliveries().finish(one));
  clock_.now_ms += kLease.count();
  EXPECT_EQ(taken(store()), "");
}

TEST_P(StoreDeliveries, WhatNobodyTookForTooLongMakesRoomForWhatComes) {
  add(store(), {delivery("m1", "https://named.no.more/"), delivery("m1")});
  clock_.now_ms += kLongest.count();
  add(store(), {delivery("m2")});
  EXPECT_EQ(taken(store()), "m1") << "not yet";
  clock_.now_ms += 1;
  add(store(), {delivery("m3")});
  EXPECT_EQ(taken(store(), "https://named.no.more/"), "");
  EXPECT_EQ(taken(store()), "m2");
  EXPECT_EQ(taken(store()), "m3");
  clock_.now_ms += kLease.count();
  EXPECT_EQ(taken(store()), "m2") << "and m1 does not come back";
}

TEST_P(StoreDeliveries, SurviveARestart) {
  add(store(), {delivery("m1")});
  const std::uint64_t mark = store().deliveries().mark().value().event;
  reopen();
  EXPECT_EQ(store().deliveries().mark().value().event, mark);
  EXPECT_EQ(taken(store()), "m1");
}

}  // namespace
}  // namespace kiln::testing
