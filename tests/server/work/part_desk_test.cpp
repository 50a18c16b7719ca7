// What the supervisor answers to a bake that gives ranges away, however that behaves. The test is the worker.

#include "server/work/part_desk.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <tuple>

#include "core/base/sha256.h"
#include "server/work/stores.h"

namespace kiln::testing {
namespace {

using namespace std::chrono_literals;

class PartDeskTest : public ::testing::Test {
 protected:
  PartDeskTest() {
    std::filesystem::create_directories(work_ / "ranges");
    std::filesystem::create_directories(work_ / "out");
    NewJob job;
    job.inputs.scene = {"scene.glb", store_bytes("scene")};
    EXPECT_TRUE(store_->touch_blob(job.inputs.scene.sha256, 5));
    job.recipe = "{}";
    job.content_key = "key";
    EXPECT_TRUE(store_->create(job));
    claim_ = store_->claim(60s, {}).value().value();
  }
  ~PartDeskTest() override {
    desk_.reset();
    std::filesystem::remove_all(folder_);
  }

  PartDesk& open(const std::string& checkpoint = "") { return desk_.emplace(claim_, place_, work_, checkpoint); }

  std::string store_bytes(const std::string& text) {
    auto writer = blobs_->write().value();
    EXPECT_TRUE(writer.write({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}));
    return writer.finish().value().sha256;
  }

  void write_journal() { std::ofstream(work_ / "out" / "journal") << "journal"; }
  /// Gives ranges of one item each away.
  void share(std::uint64_t loop, std::uint64_t ranges) {
    WorkerShare line{loop, "loop", 7, {}};
    for (std::uint64_t cut = 0; cut <= ranges; ++cut) line.cuts.push_back(cut);
    EXPECT_TRUE(desk_->hear(line));
  }
  /// What the worker reads; nothing when no answer comes.
  std::optional<RangeReply> next(std::uint64_t loop, Millis patience = 60s) {
    EXPECT_TRUE(desk_->hear(WorkerNext{loop}));
    std::string line;
    for (char letter = 0; letter != '\n';) {
      pollfd what{desk_->worker_end(), POLLIN, 0};
      if (::poll(&what, 1, static_cast<int>(patience.count())) != 1 || ::read(desk_->worker_end(), &letter, 1) != 1)
        return std::nullopt;
      line += letter;
    }
    return parse_reply(line).value();
  }
  /// What another worker does with the oldest range that waits.
  void compute_elsewhere(const std::string& items) {
    for (const PartState& part : parts()) {
      if (part.state != JobState::queued) continue;
      const Claim taken = store_->claim_part(part.id, 60s).value().value();
      const std::array made{Artifact{"range", "application/octet-stream", store_bytes(items), items.size()}};
      EXPECT_EQ(store_->commit(taken.ref, made, false), Wrote::done);
      return;
    }
    FAIL() << "no range waits";
  }
  std::vector<PartState> parts() { return store_->parts(claim_.ref.job_id).value(); }
  std::size_t rows() { return parts().size(); }
  void wait_for_rows(std::size_t count) {
    for (int i = 0; i < 500 && rows() != count; ++i) std::this_thread::sleep_for(10ms);
    EXPECT_EQ(rows(), count);
  }
  std::string text_of(const std::string& file) {
    std::ifstream in(work_ / file);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  static std::filesystem::path make_folder() {
    const bool memory = std::filesystem::is_directory("/dev/shm");  // durability has tests of its own
    const auto place = memory ? std::filesystem::path("/dev/shm") : std::filesystem::temp_directory_path();
    std::string name = (place / "kiln_desk.XXXXXX").string();
    return ::mkdtemp(name.data());
  }

  const std::filesystem::path folder_ = make_folder(), work_ = folder_ / "work";
  const std::unique_ptr<JobStore> store_ = open_job_store({}, folder_).value();
  const std::unique_ptr<BlobStore> blobs_ = open_blob_store({}, folder_).value();
  EventBus bus_;
  WorkCounters counters_;
  WorkOptions options_;
  Claim claim_;
  WorkPlace place_{*store_, *blobs_, bus_, counters_, options_};
  std::optional<PartDesk> desk_;
};

TEST_F(PartDeskTest, AWorkerComputesWhatWaitsAndIsGivenWhatOthersMade) {
  open();
  write_journal();
  share(3, 2);
  wait_for_rows(2);
  compute_elsewhere("theirs");
  const auto own = next(3).value();
  EXPECT_EQ(own.range, (LoopRange{3, 1, 2}));
  EXPECT_EQ(own.file, "");
  std::ofstream(work_ / "out" / "range.0") << "ours";
  EXPECT_TRUE(desk_->hear(WorkerMade{own.range, "range.0"}));
  const auto theirs = next(3).value();
  EXPECT_EQ(theirs.range, (LoopRange{3, 0, 1}));
  EXPECT_EQ(text_of(theirs.file), "theirs");
  EXPECT_EQ(parts()[1].state, JobState::succeeded) << "for a successor";
}

TEST_F(PartDeskTest, ASuccessorKnowsTheRangesOfItsPass) {
  for (const char* checkpoint : {"its pass", "another pass"}) {
    EXPECT_TRUE(store_->forget_parts(claim_.ref));
    const NewParts given{{part_json({{2, 4, 8}, checkpoint})}, maker_word(), {store_bytes("journal"), 7}};
    EXPECT_EQ(store_->add_parts(claim_.ref, given), Wrote::done);
    compute_elsewhere("theirs");
    open("its pass");
    EXPECT_EQ(desk_->known().size(), checkpoint == std::string("its pass") ? 1U : 0U);
    if (desk_->known().empty()) continue;
    EXPECT_EQ(text_of(next(2).value().file), "theirs");
  }
  EXPECT_EQ(rows(), 0U) << "those of another pass are forgotten";
}

/// Another processor has other last bits: a bake is not mixed.
TEST_F(PartDeskTest, WhatMakersOfOtherBitsMadeIsNotGivenOut) {
  const NewParts given{{part_json({{0, 0, 1}, ""})}, "another engine", {store_bytes("journal"), 7}};
  EXPECT_EQ(store_->add_parts(claim_.ref, given), Wrote::done);
  compute_elsewhere("of another engine");
  open();
  EXPECT_TRUE(desk_->known().empty());
  EXPECT_EQ(rows(), 0U);
  EXPECT_EQ(store_->add_parts(claim_.ref, given), Wrote::done);  // as if forgetting them had failed
  compute_elsewhere("of another engine");
  share(0, 1);
  EXPECT_EQ(next(0).value().file, "");
}

TEST_F(PartDeskTest, ASuccessorGetsAnAnswerForRangesThatAreNoMore) {
  const NewParts given{{part_json({{0, 4, 8}, ""})}, maker_word(), {store_bytes("journal"), 7}};
  EXPECT_EQ(store_->add_parts(claim_.ref, given), Wrote::done);
  open();
  desk_->pass_ended("a pass");
  const auto reply = next(0).value();
  EXPECT_EQ(reply.range, (LoopRange{0, 4, 8}));
  EXPECT_EQ(reply.file, "");
}

/// Loops of each pass have the same numbers, and their ranges may be the same.
TEST_F(PartDeskTest, WhatOthersMadeInAnEarlierPassIsNotGivenOut) {
  open("second pass");
  const NewParts of_first{{part_json({{0, 0, 1}, "first pass"})}, maker_word(), {store_bytes("journal"), 7}};
  EXPECT_EQ(store_->add_parts(claim_.ref, of_first), Wrote::done);  // as if forgetting them had failed
  compute_elsewhere("of the first pass");
  share(0, 1);  // there is no journal: nothing is added
  const auto reply = next(0).value();
  EXPECT_EQ(reply.file, "") << text_of(reply.file);
}

TEST_F(PartDeskTest, RangesOfEachPassComeInFilesOfTheirOwn) {
  open();
  write_journal();
  for (const std::string pass : {"first", "second", "third"}) {
    share(0, 1);
    wait_for_rows(1);
    compute_elsewhere(pass);
    const auto reply = next(0).value();
    ASSERT_NE(reply.file, "") << pass;
    EXPECT_EQ(text_of(reply.file), pass);
    desk_->pass_ended(pass);
    wait_for_rows(0);
    EXPECT_EQ(text_of(reply.file), "") << "what was read only takes room";
  }
}

TEST_F(PartDeskTest, ARangeThatCouldNotBeWrittenIsComputedByNobodyElse) {
  open();
  write_journal();
  share(0, 1);
  wait_for_rows(1);
  const auto own = next(0).value();
  EXPECT_EQ(own.file, "");
  EXPECT_TRUE(desk_->hear(WorkerMade{own.range, ""}));
  EXPECT_EQ(next(0, 1s), std::nullopt) << "there is none left";
  EXPECT_EQ(parts().front().state, JobState::failed);
}

TEST_F(PartDeskTest, NoLinkOfAWorkerIsFollowed) {
  std::ofstream(folder_ / "secret") << "secret!";
  std::filesystem::create_symlink(folder_ / "secret", work_ / "out" / "journal");
  open();
  share(0, 1);
  EXPECT_EQ(next(0).value().file, "") << "the worker computes it itself";
  EXPECT_EQ(rows(), 0U);
  const std::string secret = "secret!";
  EXPECT_FALSE(blobs_->exists(sha256_hex({reinterpret_cast<const std::uint8_t*>(secret.data()), secret.size()})));
}

TEST_F(PartDeskTest, APipeInsteadOfAJournalHoldsUpNobody) {
  ASSERT_EQ(::mkfifo((work_ / "out" / "journal").c_str(), 0600), 0);
  open();
  share(0, 1);
  const auto reply = next(0, 10s);
  if (!reply) ::close(::open((work_ / "out" / "journal").c_str(), O_WRONLY | O_NONBLOCK));  // lets a flawed desk end
  ASSERT_TRUE(reply);
  EXPECT_EQ(rows(), 0U);
}

TEST_F(PartDeskTest, AJournalThatIsTooShortOrTooLargeIsNotStored) {
  open();
  write_journal();
  EXPECT_TRUE(desk_->hear(WorkerShare{0, "loop", 8, {0, 1}}));
  EXPECT_TRUE(next(0));
  std::filesystem::resize_file(work_ / "out" / "journal", kMostJournal + 1);  // holes: it takes no room here
  EXPECT_TRUE(desk_->hear(WorkerShare{0, "loop", kMostJournal + 1, {0, 1}}));
  EXPECT_TRUE(next(0));
  EXPECT_EQ(rows(), 0U);
}

TEST_F(PartDeskTest, WhereTheDiskIsNearlyFullNothingIsGivenAway) {
  options_.soft_free_fraction = 1;  // no disk is that empty
  open();
  write_journal();
  share(0, 2);
  EXPECT_EQ(next(0).value().file, "");
  EXPECT_EQ(rows(), 0U);
}

/// Each answer takes room on its way. More than fit into a socket, and the desk ends all the same.
TEST_F(PartDeskTest, AWorkerThatDoesNotReadItsAnswersHoldsUpNobody) {
  open();
  share(0, 1);  // no journal: each question is answered at once
  int asked = 0;
  for (const auto end = std::chrono::steady_clock::now() + 60s;
       asked < 2000 && std::chrono::steady_clock::now() < end;) {
    if (desk_->hear(WorkerNext{0})) {
      ++asked;
    } else {
      std::this_thread::sleep_for(1ms);
    }
  }
  EXPECT_EQ(asked, 2000) << "the desk does not hear any more";
  if (asked < 2000) std::_Exit(1);  // it would never end
}

TEST_F(PartDeskTest, WhoDoesNotWaitForAnswersIsNotHeard) {
  open();
  write_journal();
  share(0, 1);
  wait_for_rows(1);
  ASSERT_TRUE(store_->claim_part(parts().front().id, 60s).value());
  int heard = 0;  // while no answer can be given
  while (heard < 1000 && desk_->hear(WorkerNext{0})) ++heard;
  EXPECT_LT(heard, 100);
  for (int pass = 0; pass < 1000; ++pass) desk_->pass_ended(std::to_string(pass));
  EXPECT_FALSE(desk_->hear(WorkerNext{0}));
}

TEST_F(PartDeskTest, AWorkerFillsTheQueueOnlySoFar) {
  open();
  write_journal();
  constexpr std::size_t kRanges = 1023;  // of one line
  for (std::uint64_t loop = 0; loop < 18; ++loop) {
    share(loop, kRanges);
    if (loop % 8 != 7 && loop < 16) continue;  // to ask takes long
    EXPECT_TRUE(next(loop));
  }
  EXPECT_EQ(rows(), 16 * kRanges) << "the first that are no more than 16384";
}

TEST_F(PartDeskTest, WithoutDescriptorsABakeIsNotShared) {
  rlimit before{}, none{};
  ::getrlimit(RLIMIT_NOFILE, &before);
  none.rlim_max = before.rlim_max;
  auto& desk = desk_;  // sanitizers open files to look at an object
  const auto& [claim, place, work] = std::tie(claim_, place_, work_);
  ::setrlimit(RLIMIT_NOFILE, &none);
  desk.emplace(claim, place, work, "");
  ::setrlimit(RLIMIT_NOFILE, &before);
  EXPECT_LT(desk_->worker_end(), 0);
}

}  // namespace
}  // namespace kiln::testing
