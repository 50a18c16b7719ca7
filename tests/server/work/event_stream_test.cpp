// What a watcher of events sees: replay, then live, never a gap.

#include "tests/server/work/service_fixture.h"

namespace kiln::testing {
namespace {

/// Reads until `done` of the job, and returns the kinds in order with repeats of progress folded.
std::vector<std::string> story(EventStream& stream, std::uint64_t* last = nullptr) {
  std::vector<std::string> kinds;
  while (const auto event = stream.next(20s)) {
    std::string kind(to_string(event->kind));
    if (event->kind == EventKind::state) kind += " " + std::string(to_string(event->state));
    if (kinds.empty() || kinds.back() != kind || kind != "progress") kinds.push_back(kind);
    if (last != nullptr && event->id != 0) *last = event->id;
    if (event->kind == EventKind::done) break;
  }
  return kinds;
}

TEST_F(ServiceTest, AWatcherSeesEveryStateInOrderAndProgressBetween) {
  start();
  const std::string id = submit("slow").id;
  const auto stream = service_->subscribe(id, 0).value();
  EXPECT_EQ(story(*stream), (std::vector<std::string>{"state queued", "state running", "progress", "state succeeded",
                                                      "artifact", "artifact", "done"}));
}

TEST_F(ServiceTest, AWatcherWhoComesBackGetsWhatItMissedAndNothingTwice) {
  start();
  const std::string id = submit("ok").id;
  service_->wait_done(id, 20s).value();
  std::uint64_t last = 0;
  story(*service_->subscribe(id, 0).value(), &last);
  EXPECT_EQ(service_->get(id)->version, last);
  EXPECT_FALSE(service_->subscribe(id, last).value()->next(50ms));
  const auto late = service_->subscribe(id, last - 1).value();
  EXPECT_EQ(late->next(1s)->kind, EventKind::done);
}

TEST_F(ServiceTest, AWatcherOfAllJobsFromNowOnSeesOnlyWhatIsNew) {
  start();
  finish("ok");
  const auto stream = service_->subscribe("", std::nullopt).value();
  EXPECT_FALSE(stream->next(50ms));
  const std::string id = submit("ok").id;
  EXPECT_EQ(stream->next(5s)->job_id, id);
}

TEST_F(ServiceTest, ProgressOfARunningJobIsInTheJobItself) {
  start();
  const std::string id = submit("slow").id;
  const auto stream = service_->subscribe(id, 0).value();
  while (const auto event = stream->next(20s)) {
    if (event->kind == EventKind::progress) break;
  }
  const Job job = service_->get(id).value();
  ASSERT_TRUE(job.progress);
  EXPECT_EQ(job.progress->stage, "transfer");
  EXPECT_TRUE(job.progress->eta_s);
}

TEST_F(ServiceTest, ADrainEndsStreamsAndWaitsAtOnce) {
  start();
  const std::string id = submit("hang").id;
  wait_running(id);
  const auto stream = service_->subscribe(id, std::nullopt).value();
  service_->drain();
  while (stream->next(20s)) {
  }
  EXPECT_TRUE(stream->closed());
}

TEST_F(ServiceTest, AnUnknownJobCannotBeWatched) {
  open();
  EXPECT_EQ(service_->subscribe("01ARZ3NDEKTSV4RRFFQ69G5FAV", 0).error().code, "not_found");
}

}  // namespace
}  // namespace kiln::testing
