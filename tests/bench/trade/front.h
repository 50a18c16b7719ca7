#pragma once
// The Pareto front: what nothing else beats in both cost and error.

#include <cstddef>
#include <span>
#include <vector>

namespace kiln::trade {

struct CostError {
  double cost = 0, error = 0;  // less is better in both
};

/// Indices of the front by ascending cost. Of equal points the first is kept.
///   i is in the front  <=>  no j has cost_j <= cost_i and error_j <= error_i, one of them less
/// Cost  n log n
std::vector<std::size_t> pareto_front(std::span<const CostError>);

}  // namespace kiln::trade
