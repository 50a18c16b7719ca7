#pragma once
// How a finished bake is shown, wherever it was baked.

#include <optional>
#include <string>

#include "client_cli/commands.h"

namespace kiln {

struct BakedFiles {
  std::string folder;
  std::vector<std::string> names;
  std::string report;  // text of report.json; empty when it is not among them
};

/// The folder for a result: `output`, or the input's name without its extension and "-baked" behind it.
std::string output_folder(const std::string& output, const std::string& input);

/// Names the files on stdout (with --json: one object with folder, files, certificate and warnings), tells warnings and
/// certificate, and fails with target_missed when its error is above `max_error`.
Outcome<ExitCode> show_bake(const BakedFiles&, std::optional<double> max_error, const Session&);

}  // namespace kiln
