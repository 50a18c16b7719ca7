#include "core/base/threads.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <vector>

#include "core/base/expects.h"

namespace kiln {
namespace {

TEST(Threads, BlocksCoverEveryItemOnceWithFixedBorders) {
  for (const int count : {1, 2, 3}) {
    Threads threads(count);
    for (const std::size_t items : {0, 1, 9, 10, 11, 1000}) {
      std::vector<std::atomic<int>> seen(items);
      threads.for_blocks(items, 10, [&](std::size_t begin, std::size_t end) {
        EXPECT_EQ(begin % 10, 0U);
        EXPECT_EQ(end, std::min(items, begin + 10));
        for (std::size_t i = begin; i < end; ++i) ++seen[i];
      });
      for (const auto& times : seen) EXPECT_EQ(times, 1);
    }
  }
}

TEST(Threads, CountIsWhatWasAskedForAndNeverZero) {
  EXPECT_EQ(Threads(1).count(), 1);
  EXPECT_EQ(Threads(3).count(), 3);
  EXPECT_GE(Threads().count(), 1);
  EXPECT_THROW(Threads(-1), ContractViolation);
}

TEST(Threads, NeverMoreBodiesAtOnceThanThreads) {
  Threads threads(2);
  std::atomic<int> inside{0}, most{0};
  threads.for_blocks(200, 1, [&](std::size_t, std::size_t) {
    const int now = ++inside;
    for (int seen = most; now > seen && !most.compare_exchange_weak(seen, now);) {
    }
    --inside;
  });
  EXPECT_LE(most, 2);
  EXPECT_GE(most, 1);
}

TEST(Threads, StopEndsTheLoopWithCancelled) {
  Threads threads(2);
  std::atomic<int> blocks{0};
  EXPECT_THROW(threads.for_blocks(100000, 1,
                                  [&](std::size_t, std::size_t) {
                                    if (++blocks == 10) threads.stop();
                                  }),
               Cancelled);
  EXPECT_LT(blocks, 100000);
  EXPECT_TRUE(threads.stopping());
  EXPECT_THROW(threads.check(), Cancelled);
  EXPECT_THROW(threads.for_blocks(1, 1, [](std::size_t, std::size_t) {}), Cancelled);
}

TEST(Threads, TimeThatIsUpStopsLoopsUntilItIsTakenBack) {
  Threads threads(2);
  threads.stop_after(3600);
  EXPECT_NO_THROW(threads.check());
  threads.stop_after(0);
  EXPECT_THROW(threads.for_blocks(1000, 1, [](std::size_t, std::size_t) {}), Cancelled);
  threads.forever();
  EXPECT_NO_THROW(threads.check());
  threads.stop();
  threads.forever();
  EXPECT_THROW(threads.check(), Cancelled);  // who was asked to stop still stops
}

TEST(Threads, WhatABodyThrowsArrivesAtTheCaller) {
  Threads threads(2);
  EXPECT_THROW(threads.for_blocks(100, 1,
                                  [](std::size_t i, std::size_t) {
                                    if (i == 50) throw std::out_of_range("x");
                                  }),
               std::out_of_range);
}

TEST(Threads, LoopsNestAndRunInsideThePool) {
  Threads threads(2);
  std::atomic<int> sum{0};
  threads.run([&] {
    threads.for_blocks(
        4, 1, [&](std::size_t, std::size_t) { threads.for_blocks(5, 1, [&](std::size_t, std::size_t) { ++sum; }); });
  });
  EXPECT_EQ(sum, 20);
}

TEST(Threads, BlockOfNothingIsOurOwnMistake) {
  Threads threads(1);
  EXPECT_THROW(threads.for_blocks(1, 0, [](std::size_t, std::size_t) {}), ContractViolation);
}

}  // namespace
}  // namespace kiln
