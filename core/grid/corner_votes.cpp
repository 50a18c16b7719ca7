#include "core/grid/corner_votes.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace kiln {
namespace {

/// How many votes see each corner.
struct Tally {
  std::array<int, 8> seen{};
  int votes = 0;

  void add(const CornerVote& v) {
    ++votes;
    for (std::size_t k = 0; k < 8; ++k) seen[k] += v.seen >> k & 1;
  }
  void take(const CornerVote& v) {
    --votes;
    for (std::size_t k = 0; k < 8; ++k) seen[k] -= v.seen >> k & 1;
  }
  /// The corners that at least half of the votes see.
  std::uint8_t majority() const {
    unsigned bits = 0;
    for (std::size_t k = 0; k < 8; ++k) bits |= 2 * seen[k] >= votes && votes > 0 ? 1U << k : 0U;
    return static_cast<std::uint8_t>(bits);
  }
  int outvoted() const {
    int sum = 0;
    for (const int n : seen) sum += std::min(n, votes - n);
    return sum;
  }
};

/// A plane that parts votes: how many it leaves outvoted, and how far it stands from the nearest.
struct Parting {
  int outvoted = 0;
  double margin = 0;
  CornerCut cut;

  bool better_than(const Parting& other) const {
    return outvoted != other.outvoted ? outvoted < other.outvoted : margin > other.margin;
  }
};

/// The best plane of one direction. `votes` are put in the order of their heights above it.
Parting best_along(int direction, const Tally& all, std::vector<std::pair<double, const CornerVote*>>& votes) {
  const Vec3d m = CornerCut::normal(direction);
  for (auto& [height, vote] : votes) height = CornerCut::height(m, vote->fraction);
  std::sort(votes.begin(), votes.end());
  Parting best{all.outvoted(), 0, {.below = {.bits = all.majority()}}};
  Tally below, above = all;
  for (std::size_t i = 0; i + 1 < votes.size(); ++i) {
    below.add(*votes[i].second), above.take(*votes[i].second);
    const double low = votes[i].first, high = votes[i + 1].first, offset = std::round((low + high) / 2);
    if (!(low < offset && offset <= high)) continue;
    Parting next{below.outvoted() + above.outvoted(), (high - low) / length(m), {}};
    if (next.outvoted == all.outvoted() || !next.better_than(best)) continue;
    next.cut = {static_cast<std::uint8_t>(direction),
                static_cast<std::uint8_t>(offset),
                {.bits = below.majority()},
                {.bits = above.majority()}};
    best = next;
  }
  return best;
}

}  // namespace

CornerCut best_cut(std::span<const CornerVote> votes) {
  Tally all;
  for (const CornerVote& v : votes) all.add(v);
  Parting best{all.outvoted(), 0, {.below = {.bits = all.majority()}}};
  if (best.outvoted == 0) return best.cut;
  std::vector<std::pair<double, const CornerVote*>> sorted;
  for (const CornerVote& v : votes) sorted.emplace_back(0, &v);
  for (int direction = 0; direction < CornerCut::kDirectionsOfPlanes; ++direction) {
    const Parting next = best_along(direction, all, sorted);
    if (next.better_than(best)) best = next;
  }
  return best.cut;
}

}  // namespace kiln
