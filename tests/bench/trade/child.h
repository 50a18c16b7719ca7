#pragma once
// A piece of work in a process of its own, so that its peak memory is its own and its crash not ours.

#include <functional>
#include <string>

#include "core/base/result.h"

namespace kiln::trade {

/// Runs `work` in a forked child and gives back its text. The caller must not have made threads yet.
/// Fails  as `work` does, or child_died
Result<std::string> in_child(const std::function<Result<std::string>()>& work);

}  // namespace kiln::trade
