#pragma once
// The two plots of a sweep.

#include <span>
#include <string>

#include "tests/bench/trade/row.h"
#include "tests/bench/trade/sweep.h"

namespace kiln::trade {

/// Processor seconds, and bytes of scene.glb, against transport error where it can be seen. Runs of fewer bands than
/// the standard are judged under softer light: they are drawn hollow and stand in no front.
std::string time_svg(std::span<const Row>, const PresetNames&);
std::string bytes_svg(std::span<const Row>, const PresetNames&);

}  // namespace kiln::trade
