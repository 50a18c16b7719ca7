#pragma once
// One run: a bake in a process of its own, measured, and its error measured again by somebody else.

#include <string>

#include "core/artifact/import.h"
#include "core/base/result.h"
#include "tests/bench/trade/row.h"

namespace kiln::trade {

struct TradeScene {
  std::string name;
  SceneFiles files;
};

struct RunOptions {
  bool thorough = true;  // measure the error at up to 8192 points, about a second or two; else at 1024
};

/// What is known of a run before it: everything that key_of asks for.
/// Fails  bad_recipe when the sweep asks for what no recipe may
Result<Row> planned_row(const TradeScene&, const std::string& setting, const std::string& recipe);

/// Bakes and fills in the rest of the row.   Fails  as bake() does
Result<Row> run(const TradeScene&, const Row& planned, const RunOptions&);

/// Triangles of the scene as imported, counted in a child.
Result<std::uint64_t> count_triangles(const TradeScene&);

}  // namespace kiln::trade
