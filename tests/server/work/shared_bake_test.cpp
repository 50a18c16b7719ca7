// Loops that are given away and taken, without processes: what travels is the files that they would write.

#include "server/work/shared_bake.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <filesystem>
#include <fstream>
#include <functional>

#include "core/base/random.h"
#include "server/work/loop_journal.h"

namespace kiln::testing {
namespace {

using namespace std::chrono_literals;

/// A "bake" of three loops, each of which needs all of the one before it; a block of the second takes `pause`.
struct ToyBake {
  std::chrono::microseconds pause{0};
  std::size_t computed = 0;  // blocks of the second loop

  std::vector<double> run(Threads& threads) {
    std::vector<double> a(100), b(1000), c(10);
    loop("first", a, threads, [](std::size_t i) { return std::sqrt(static_cast<double>(i)); });
    loop(
        "second", b, threads, [&](std::size_t i) { return a[i % 100] * std::sin(static_cast<double>(i)); }, pause);
    loop("third", c, threads, [&](std::size_t i) {
      double sum = 0;
      for (std::size_t k = i; k < b.size(); k += 10) sum += b[k];
      return sum;
    });
    return c;
  }

 private:
  template <class F>
  void loop(const char* name, std::vector<double>& out, Threads& threads, const F& value,
            std::chrono::microseconds wait = {}) {
    std::atomic<std::size_t> blocks = 0;
    run_loop({.name = name,
              .items = out.size(),
              .block = out.size() == 1000 ? std::size_t{4} : 1024,  // the others cannot be cut
              .body =
                  [&](std::size_t begin, std::size_t end) {
                    if (wait.count() > 0) std::this_thread::sleep_for(wait);
                    for (std::size_t i = begin; i < end; ++i) out[i] = value(i);
                    ++blocks;
                  },
              .pass = [&](std::size_t begin, std::size_t end,
                          ItemStream& items) { items.pass(std::span(out).subspan(begin, end - begin)); }},
             threads);
    if (out.size() == 1000) computed = blocks;
  }
};

class SharedBake : public ::testing::Test {
 protected:
  SharedBake() {
    std::string name = (std::filesystem::temp_directory_path() / "kiln_shared.XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
    plain_ = ToyBake().run(threads_);
  }
  ~SharedBake() override { std::filesystem::remove_all(folder_); }

  /// What a part's worker does; the file that it made.
  std::string take(const LoopRange& range) {
    const std::string file = folder_ / ("took" + std::to_string(files_++));
    Threads threads(2);
    TakingLoops loops(range, FileBytes::map(journal(), "journal").value(), file);
    threads.share_with(&loops);
    ToyBake bake;
    EXPECT_THROW(bake.run(threads), RangeDone);
    return file;
  }

  /// What was in the journal when a loop was given away.
  std::string journal() const { return folder_ / "journal"; }

  using Answer = std::function<RangeReply(std::deque<LoopRange>& left)>;

  /// A bake that gives ranges of its second loop away, in so many passes; `answer` says what to do with those that are
  /// left.
  std::vector<double> give(const Answer& answer, const std::vector<LoopRange>& known = {}, int passes = 0) {
    shared_.reset();
    std::filesystem::remove_all(folder_ / "giver");
    std::filesystem::create_directory(folder_ / "giver");
    std::deque<LoopRange> left(known.begin(), known.end());
    Threads threads(1);
    GivingLoops loops({.least_s = 0.02, .repeats = 0}, known, (folder_ / "giver").string(),
                      {[&](const WorkerLine& line) {
                         if (const auto* made = std::get_if<WorkerMade>(&line)) made_.push_back(made->file);
                         const auto* share = std::get_if<WorkerShare>(&line);
                         if (share == nullptr) return;
                         shared_ = *share;
                         std::filesystem::copy_file(folder_ / "giver" / "journal", journal(),
                                                    std::filesystem::copy_options::overwrite_existing);
                         for (std::size_t k = 0; k + 1 < share->cuts.size(); ++k)
                           left.push_back({share->loop, share->cuts[k], share->cuts[k + 1]});
                       },
                       [&](std::uint64_t loop) {
                         EXPECT_EQ(loop, 1U);
                         return answer(left);
                       }});
    threads.share_with(&loops);
    ToyBake bake{.pause = 1ms};
    for (int pass = 1; pass < passes; ++pass) {
      loops.begin_pass();
      EXPECT_EQ(bake.run(threads), plain_);
    }
    if (passes > 0) loops.begin_pass();
    auto result = bake.run(threads);
    computed_ = bake.computed;
    return result;
  }

  static LoopRange pop(std::deque<LoopRange>& left) {
    const LoopRange range = left.front();
    left.pop_front();
    return range;
  }

  std::filesystem::path folder_;
  Threads threads_{2};
  std::vector<double> plain_;
  std::optional<WorkerShare> shared_;
  std::vector<std::string> made_;  // files of ranges
  std::size_t computed_ = 0;
  int files_ = 0;
};

TEST_F(SharedBake, RangesOfOthersGiveTheSameBits) {
  int taken = 0;
  const auto result = give([&](std::deque<LoopRange>& left) {
    const LoopRange range = pop(left);
    return RangeReply{range, taken++ % 2 == 0 ? take(range) : ""};
  });
  EXPECT_EQ(result, plain_);
  ASSERT_TRUE(shared_);
  EXPECT_GE(taken, 3);
  EXPECT_LT(computed_, 250U) << "blocks that others computed were computed again";
}

TEST_F(SharedBake, APartWritesItsRangeAlone) {
  give([&](std::deque<LoopRange>& left) {
    const LoopRange range = pop(left);
    if (left.empty()) {
      const std::uint64_t head = 5 * sizeof(std::uint64_t), items = (range.last - range.first) * sizeof(double);
      EXPECT_EQ(std::filesystem::file_size(take(range)), head + items);
    }
    return RangeReply{range, ""};
  });
}

TEST_F(SharedBake, AShortLoopIsNotGivenAway) {
  std::filesystem::create_directory(folder_ / "giver");
  Threads threads(1);
  GivingLoops loops({.least_s = 1000}, {}, (folder_ / "giver").string(),
                    {[](const WorkerLine&) { FAIL(); }, [](std::uint64_t) { return RangeReply{}; }});
  threads.share_with(&loops);
  EXPECT_EQ(ToyBake().run(threads), plain_);
}

TEST_F(SharedBake, ASuccessorTakesUpWhatWasGivenAway) {
  std::vector<LoopRange> given;
  give([&](std::deque<LoopRange>& left) {
    given.push_back(left.front());
    return RangeReply{pop(left), ""};
  });
  const auto result = give(
      [&](std::deque<LoopRange>& left) {
        const LoopRange range = pop(left);
        return RangeReply{range, take(range)};
      },
      given);
  EXPECT_EQ(result, plain_);
  EXPECT_FALSE(shared_) << "the ranges were known";
  EXPECT_EQ(computed_, (given.front().first + 3) / 4);
}

/// Ranges of each pass have the same numbers, and may begin at the same item.
TEST_F(SharedBake, EachRangeHasAFileOfItsOwnInAllPasses) {
  const auto result = give([&](std::deque<LoopRange>& left) { return RangeReply{pop(left), ""}; }, {}, 3);
  EXPECT_EQ(result, plain_);
  EXPECT_GE(made_.size(), 6U);
  std::ranges::sort(made_);
  EXPECT_EQ(std::ranges::adjacent_find(made_), made_.end()) << "what is written twice cannot be written";
}

TEST_F(SharedBake, ARangeThatCannotBeWrittenIsComputedAllTheSame) {
  std::string in_the_way;
  const auto result = give([&](std::deque<LoopRange>& left) {
    if (in_the_way.empty()) std::filesystem::create_directory(in_the_way = folder_ / "giver" / "range.0");
    return RangeReply{pop(left), ""};
  });
  EXPECT_EQ(result, plain_);
  ASSERT_GE(made_.size(), 2U);
  EXPECT_EQ(made_[0], "");
  EXPECT_NE(made_[1], "");
}

TEST_F(SharedBake, WithoutRoomForItsJournalABakeSharesNothing) {
  ::signal(SIGXFSZ, SIG_IGN);
  rlimit before{}, none{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  none.rlim_max = before.rlim_max;
  ::setrlimit(RLIMIT_FSIZE, &none);
  const auto result = give([](std::deque<LoopRange>& left) { return RangeReply{pop(left), ""}; });
  ::setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_EQ(result, plain_);
  EXPECT_FALSE(shared_);
}

TEST_F(SharedBake, WhatIsOfAnotherBakeIsRefused) {
  EXPECT_THROW(give([](std::deque<LoopRange>& left) {
                 return RangeReply{{1, left.front().first, 9999}, ""};
               }),
               ForeignLoop)
      << "a range that was not given away";
  EXPECT_THROW(give([&](std::deque<LoopRange>& left) {
                 const LoopRange wrong = left.back();
                 return RangeReply{left.front(), take(wrong)};
               }),
               ForeignLoop)
      << "the items of another range";
}

TEST_F(SharedBake, ACutOrStrangeJournalIsRefused) {
  give([&](std::deque<LoopRange>& left) { return RangeReply{pop(left), ""}; });
  const auto refuses = [&](const LoopRange& range) {
    Threads threads(1);
    TakingLoops loops(range, FileBytes::map(journal(), "journal").value(), (folder_ / "out").string());
    threads.share_with(&loops);
    EXPECT_THROW(ToyBake().run(threads), ForeignLoop) << range.loop << " " << range.first << " " << range.last;
  };
  refuses({2, 0, 8});     // the journal ends before this loop
  refuses({1, 0, 1004});  // beyond its end
  refuses({1, 2, 8});     // not a whole block
  const auto whole = std::filesystem::file_size(journal());
  for (const std::uintmax_t bytes : {whole - 1, whole / 2, std::uintmax_t{40}, std::uintmax_t{7}}) {
    std::filesystem::resize_file(journal(), bytes);
    refuses({1, 0, 8});
  }
}

TEST(CutLoop, RangesCoverWhatIsLeftInWholeBlocks) {
  for (const std::uint64_t items : {1ULL, 63ULL, 64ULL, 1000ULL, 123'457ULL}) {
    for (const std::uint64_t least : {0ULL, 1ULL, 100ULL, 1'000'000ULL}) {
      const auto cuts = cut_loop(0, items, 16, least);
      ASSERT_GE(cuts.size(), 2U);
      EXPECT_EQ(cuts.front(), 0U);
      EXPECT_EQ(cuts.back(), items);
      for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
        EXPECT_LT(cuts[k], cuts[k + 1]);
        EXPECT_EQ(cuts[k] % 16, 0U);
        EXPECT_TRUE(cuts[k + 1] - cuts[k] >= least || cuts.size() == 2) << items << " " << least << " " << k;
      }
      EXPECT_LE(cuts.size(), 1024U) << "the most that a supervisor takes";
    }
  }
}

}  // namespace
}  // namespace kiln::testing
