#pragma once
// How much of a vertex's direct light comes from lamps in whose reach it lies (bright_spots.h): what gathering rays
// that read the vertex leave to looks.

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/prt/bright_spots.h"
#include "core/prt/transfer_point.h"

namespace kiln {

class SpotShares {
 public:
  /// `point_of` tells where the light of a vertex was taken. Vertices of every triangle that a reach may touch have a
  /// share, if the lamp lights them.
  SpotShares(const BrightSpots&, const Lamps&, const Mesh&,
             const std::function<TransferPoint(std::uint32_t)>& point_of);

  struct Share {
    std::uint32_t vertex, lamp;  // index into BrightSpots::lamps()
    Vec3f share;                 // of the vertex's direct light, each channel 0..1
  };
  std::span<const Share> of(std::uint32_t vertex) const {
    return first_.empty() ? std::span<const Share>{}
                          : std::span(shares_).subspan(first_[vertex], first_[vertex + 1] - first_[vertex]);
  }

 private:
  std::vector<Share> shares_;         // by vertex
  std::vector<std::uint32_t> first_;  // of each vertex, and the end
};

}  // namespace kiln
