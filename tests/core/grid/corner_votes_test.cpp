// Votes on corners, and the plane that parts them.

#include "core/grid/corner_votes.h"

#include <gtest/gtest.h>

#include <vector>

#include "core/base/random.h"

namespace kiln {
namespace {

/// `count` places all over a cell; `sees` says what each sees.
template <class F>
std::vector<CornerVote> votes_of(std::uint64_t count, const F& sees) {
  std::vector<CornerVote> votes;
  for (std::uint64_t i = 0; i < count; ++i) {
    Random random(7, i);
    CornerVote vote;
    for (double& x : vote.fraction) x = random.uniform_double();
    vote.seen = sees(vote.fraction);
    votes.push_back(vote);
  }
  return votes;
}

std::size_t right(const CornerCut& cut, const std::vector<CornerVote>& votes) {
  std::size_t sum = 0;
  for (const CornerVote& v : votes) sum += cut.at(v.fraction).bits == v.seen ? 1U : 0U;
  return sum;
}

TEST(CornerVotes, ThatAgreeNeedNoPlane) {
  const CornerCut cut = best_cut(votes_of(32, [](auto&) { return std::uint8_t{0x5a}; }));
  EXPECT_EQ(cut, (CornerCut{.below = {.bits = 0x5a}}));
}

TEST(CornerVotes, PartedByAPlaneOfTheTableAreAllRight) {
  for (const int direction : {40, 0, 100, 202, 242}) {
    const Vec3d m = CornerCut::normal(direction);
    const auto votes = votes_of(64, [&](const auto& f) {
      return m.x * (f[0] - 0.5) + m.y * (f[1] - 0.5) + m.z * (f[2] - 0.5) >= 0.1 ? std::uint8_t{0xf0} : std::uint8_t{3};
    });
    EXPECT_EQ(right(best_cut(votes), votes), votes.size()) << direction;
  }
}

TEST(CornerVotes, PartedByAnyPlaneAreNearlyAllRight) {
  // Directions of the table are at most a few degrees from any plane: within a cell that moves it by a hundredth or
  // two.
  std::size_t sum = 0, all = 0;
  for (std::uint64_t k = 0; k < 50; ++k) {
    Random random(8, k);
    const double x = random.uniform_double() - 0.5, y = random.uniform_double() - 0.5,
                 z = random.uniform_double() - 0.5;
    const auto votes = votes_of(128, [&](const auto& f) {
      return x * (f[0] - 0.5) + y * (f[1] - 0.5) + z * (f[2] - 0.5) >= 0 ? std::uint8_t{0xff} : std::uint8_t{0};
    });
    sum += right(best_cut(votes), votes), all += votes.size();
  }
  EXPECT_GT(static_cast<double>(sum) / static_cast<double>(all), 0.98);
}

TEST(CornerVotes, OfOnePlaceCannotBePartedAndTheMajorityCounts) {
  std::vector<CornerVote> votes(5);
  for (CornerVote& v : votes) v.fraction = {0.2, 0.3, 0.4};
  votes[0].seen = votes[1].seen = votes[2].seen = 0x0f;
  votes[3].seen = 0xff;
  const CornerCut cut = best_cut(votes);
  EXPECT_EQ(cut.offset, 0);
  EXPECT_EQ(cut.below.bits, 0x0f);
}

}  // namespace
}  // namespace kiln
