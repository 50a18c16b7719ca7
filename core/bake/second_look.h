#pragma once
// The second look of a certificate: where the reference is least trusted it is traced again, by many more paths that
// know nothing of the first, and the first are thrown away.

#include <algorithm>
#include <cstddef>
#include <functional>
#include <numeric>
#include <span>
#include <vector>

namespace kiln {

inline constexpr std::size_t kDoubtful = 100;  // one point in so many is looked at again,
inline constexpr int kMorePaths = 16;          // with so many times the paths: a sixth of the cost

/// A hundredth of the points, those of the largest doubt. Doubt has to be the squared difference and its noise
/// together: of noise alone the two are alike, so that leaving out these does not change the expectation of their
/// difference, which is the error; the largest differences alone would be those that noise has made larger.
inline std::vector<std::size_t> doubtful_points(std::span<const double> doubt) {
  std::vector<std::size_t> order(doubt.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, std::greater{}, [&](std::size_t p) { return doubt[p]; });
  order.resize((doubt.size() + kDoubtful - 1) / kDoubtful);
  return order;
}

}  // namespace kiln
