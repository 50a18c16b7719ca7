#pragma once
// What outlives a bake in passes that is cut off: the record of each pass. Passes are planned from records alone, so
// that a later bake of the same input replays the decisions, goes on with the next pass and ends with the bytes of an
// undisturbed one. A bake killed after its last pass repeats that one.

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/bake/progressive.h"

namespace kiln {

/// JSON, a few hundred bytes a pass; numbers come back bit for bit.
std::string checkpoint_json(std::span<const PassRecord>);

/// Empty for anything that this engine did not write: the bake then begins at its beginning.
std::vector<PassRecord> parse_checkpoint(std::string_view);

}  // namespace kiln
