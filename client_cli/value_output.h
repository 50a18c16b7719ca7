#pragma once
// What eval and reference share at their end: the table goes out, and points without a surface are told.

#include "client_cli/commands.h"
#include "client_cli/values.h"

namespace kiln {

/// Writes CSV (or JSON with --json) to `output`, "" being stdout, and warns of points that lie on no surface or far
/// off.
Outcome<ExitCode> write_values(const ValueTable&, double scene_size, const std::string& output, const Session&);

}  // namespace kiln
