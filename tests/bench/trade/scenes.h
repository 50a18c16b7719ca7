#pragma once
// The scenes of a sweep.

#include <string>
#include <vector>

#include "core/base/result.h"
#include "tests/bench/trade/run.h"

namespace kiln::trade {

/// The two demo scenes, and of the models beside the checkout the references and one interior, where they are.
std::vector<std::string> bundled_scenes();

/// A demo scene by its name, anything else by its path.
/// Fails  as reading a file does
Result<TradeScene> load_trade_scene(const std::string& name_or_path);

}  // namespace kiln::trade
