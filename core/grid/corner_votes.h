#pragma once
// Places of one cell and direction vote on the corners that count, parted by a plane where they differ.
// A corner counts where at least half of the votes see it; of all planes that lie between two votes the one counts that
// leaves the fewest outvoted, of equals the one that stands farthest from the votes beside it.
// Cost    kDirectionsOfPlanes sorts of the votes, where they differ

#include <array>
#include <cstdint>
#include <span>

#include "core/grid/grid.h"

namespace kiln {

/// One place of a surface: which corners its side sees.
struct CornerVote {
  std::uint64_t key = 0;  // cell x kDirections + direction
  std::uint8_t seen = 0;
  std::array<double, 3> fraction{};  // its place in the cell
  Vec3f origin;                      // of its rays
};

CornerCut best_cut(std::span<const CornerVote>);

}  // namespace kiln
