#include "tests/bench/trade/front.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace kiln::trade {

std::vector<std::size_t> pareto_front(std::span<const CostError> points) {
  std::vector<std::size_t> order(points.size()), front;
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const CostError &p = points[a], &q = points[b];
    return p.cost != q.cost ? p.cost < q.cost : p.error < q.error;
  });
  double best = std::numeric_limits<double>::infinity();
  for (const std::size_t i : order) {
    if (points[i].error >= best) continue;
    best = points[i].error;
    front.push_back(i);
  }
  return front;
}

}  // namespace kiln::trade
