#pragma once
// The command line, parsed to plain structs. The parsing library stays inside.

#include <optional>
#include <string>
#include <vector>

#include "client_cli/options.h"

namespace kiln {

struct ParsedArguments {
  std::optional<Options> options;  // nothing: help was asked for, or the usage is wrong
  int exit = 0;                    // then: 0 or 2
  std::string out, err;            // then: what to print
};

ParsedArguments parse_arguments(int argc, const char* const* argv);

/// A command and its long options, for shell completion.
struct CommandWords {
  std::string name, description;
  std::vector<std::string> options;  // "--json"
};
std::vector<CommandWords> command_words();

}  // namespace kiln
