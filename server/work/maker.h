#pragma once
// Who computes the same bits.

#include <string>

namespace kiln {

/// The engine's version, and the kind of processor, by which Embree chooses its code: whoever has the same word makes
/// the same bits of the same inputs.
std::string maker_word();

}  // namespace kiln
