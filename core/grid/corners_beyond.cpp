#include "core/grid/corners_beyond.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "core/grid/cell_corners.h"

namespace kiln {
namespace {

constexpr std::size_t kBlock = 256;

/// Of a place from a vertex, in spacings; at least a hair.
double squared_distance(const Lattice& lattice, const CornerVote& v, const std::array<int, 3>& vertex) {
  const std::array<int, 3> cell = lattice.cell(v.key / kDirections);
  double sum = 1e-6;
  for (std::size_t axis = 0; axis < 3; ++axis) sum += std::pow(cell[axis] + v.fraction[axis] - vertex[axis], 2);
  return sum;
}

/// For places that see no corner of their cell, as in slivers between a wall and the next vertices: the neighbour of
/// which they see the most, nearer corners before others. Asks a few of the places.
CornerSet neighbour_seen(const Tracer& tracer, const Lattice& lattice, const std::vector<Vec3f>& stands,
                         std::span<const CornerVote> votes, std::uint64_t& rays) {
  constexpr std::size_t kAsked = 4;
  const std::size_t asked = std::min(kAsked, votes.size());
  CornerSet best;
  double most = 0;
  for (std::uint8_t cell = 0; cell < CornerSet::kCells; ++cell) {
    double score = 0;
    std::array<std::size_t, 8> seen{};
    for (std::size_t i = 0; i < asked; ++i) {
      const CornerVote& v = votes[i * votes.size() / asked];
      const auto moved = moved_into(lattice, {lattice.cell(v.key / kDirections), v.fraction}, cell);
      if (cell == CornerSet::kOwnCell || !moved) break;
      const std::uint8_t bits = corners_seen(tracer, lattice, stands, *moved, v.origin);
      rays += 8;
      for (std::size_t k = 0; k < 8; ++k) {
        if ((bits >> k & 1) == 0) continue;
        ++seen[k];
        score += 1 / squared_distance(lattice, v, lattice.corner(moved->cell, static_cast<int>(k)));
      }
    }
    unsigned bits = 0;
    for (std::size_t k = 0; k < 8; ++k) bits |= seen[k] > 0 && 2 * seen[k] >= asked ? 1U << k : 0U;
    if (bits != 0 && score > most) most = score, best = {cell, static_cast<std::uint8_t>(bits)};
  }
  return best;
}

/// What a cell takes from neighbour `step` where no place voted in it: the corners that count there in the middle of
/// the wall between them, as seen from here. No bits where those lie two cells away.
CornerSet borrowed(const CornerCut& theirs, const std::array<int, 3>& step) {
  const auto nearest = [&](std::size_t axis) { return std::clamp(0.5 - step[axis], 0.0, 1.0); };
  const CornerSet& set = theirs.at({nearest(0), nearest(1), nearest(2)});
  const std::array<int, 3> on{set.cell % 3 - 1, set.cell / 3 % 3 - 1, set.cell / 9 - 1};
  int cell = 0;
  for (std::size_t axis = 3; axis-- > 0;) {
    const int sum = on[axis] + step[axis];
    if (sum < -1 || sum > 1) return {};
    cell = 3 * cell + sum + 1;
  }
  return {static_cast<std::uint8_t>(cell), set.bits};
}

}  // namespace

void look_beyond(const Tracer& tracer, const Lattice& lattice, const std::vector<Vec3f>& stands,
                 std::span<const CornerVote> votes, CornerCut& cut, std::uint64_t& rays) {
  if (cut.offset == 0 && cut.below.bits == 0) {
    const CornerSet beyond = neighbour_seen(tracer, lattice, stands, votes, rays);
    if (beyond.bits == 0) return;
    std::vector<CornerVote> again(votes.begin(), votes.end());
    for (CornerVote& v : again) {
      const auto moved = moved_into(lattice, {lattice.cell(v.key / kDirections), v.fraction}, beyond.cell);
      v.seen = corners_seen(tracer, lattice, stands, *moved, v.origin);
    }
    rays += 8 * again.size();
    cut = best_cut(again);
    cut.below.cell = cut.above.cell = beyond.cell;
  }
  for (CornerSet* side : {&cut.below, &cut.above}) {
    if (side->bits != 0 || (side == &cut.above && cut.offset == 0)) continue;
    std::vector<CornerVote> own;
    for (const CornerVote& v : votes) {
      if (&cut.at(v.fraction) == side) own.push_back(v);
    }
    *side = neighbour_seen(tracer, lattice, stands, own, rays);
  }
}

void fill_grazed(const Lattice& lattice, const std::vector<bool>& crossed, std::vector<CellCorners>& cells,
                 Threads& threads) {
  std::vector<std::array<int, 3>> steps;
  for (int away = 1; away <= 3; ++away) {
    for (int k = 0; k < CornerSet::kCells; ++k) {
      const std::array<int, 3> step{k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1};
      if (std::abs(step[0]) + std::abs(step[1]) + std::abs(step[2]) == away) steps.push_back(step);
    }
  }
  const std::vector<CellCorners> voted = cells;
  const auto stand_in = [&](std::size_t i, std::size_t direction) {
    const std::array<int, 3> cell = lattice.cell(i), count = lattice.cells();
    for (const std::array<int, 3>& step : steps) {
      std::array<int, 3> at = cell;
      bool within = true;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        at[axis] += step[axis];
        within = within && at[axis] >= 0 && at[axis] < count[axis];
      }
      if (!within) continue;
      const CornerSet set = borrowed(voted[lattice.cell_index(at)].surface[direction], step);
      if (set.bits != 0) return set;
    }
    return CornerSet{};
  };
  threads.for_blocks(cells.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      for (std::size_t d = 0; crossed[i] && d < kDirections; ++d) {
        if (voted[i].surface[d] == CornerCut{}) cells[i].surface[d].below = stand_in(i, d);
      }
    }
  });
}

}  // namespace kiln
