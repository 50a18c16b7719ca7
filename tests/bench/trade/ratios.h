#pragma once
// How far the plan's predictions were off, from the rows alone.

#include <span>
#include <string>
#include <vector>

#include "tests/bench/trade/row.h"

namespace kiln::trade {

/// predicted / measured over the runs of a scene: 1 is right, 2 is twice too much.
struct Ratio {
  double median = 0, worst = 0;  // worst: farthest from 1 as a ratio
  std::string worst_setting;
};

struct SceneRatios {
  std::string scene;
  std::size_t runs = 0;
  Ratio seconds;      // by the wall clock
  Ratio cpu_seconds;  // predicted seconds times threads against processor seconds
  Ratio rays, memory, bytes, vertices;
};

std::vector<SceneRatios> prediction_ratios(std::span<const Row>);
std::string ratios_text(const std::vector<SceneRatios>&);

}  // namespace kiln::trade
