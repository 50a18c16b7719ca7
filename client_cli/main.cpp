// kiln: the command-line client.
#include <cstdio>
#include <exception>
#include <new>

#include "client_cli/arguments.h"
#include "client_cli/commands.h"

namespace {

using namespace kiln;

/// Runs the command; what it could not do is shown and becomes an exit code.
ExitCode run_command(const Options& options) {
  const Terminal terminal = detect_terminal(options.common.json);
  const auto ended = [&](const Failure& failure) {
    if (failure.exit == ExitCode::interrupted) {
      say("interrupted");
    } else {
      show_failure(terminal, failure);
    }
    return failure.exit;
  };
  Interrupt interrupt;
  Session session{options.common, terminal, interrupt};
  try {
    const Outcome<ExitCode> outcome =
        std::visit([&](const auto& command) { return run(command, session); }, options.command);
    return outcome ? *outcome : ended(outcome.error());
  } catch (const Cancelled&) {
    return ended({ExitCode::interrupted, {}});
  } catch (const std::bad_alloc&) {
    return ended(fail(ExitCode::error, "out_of_memory", "there is not enough memory").value());
  } catch (const std::exception& mistake) {
    return ended(fail(ExitCode::error, "internal", std::string("a mistake of ours: ") + mistake.what()).value());
  }
}

}  // namespace

int main(int argc, char** argv) {
  const ParsedArguments parsed = parse_arguments(argc, argv);
  if (parsed.options) return static_cast<int>(run_command(*parsed.options));
  std::fputs(parsed.out.c_str(), stdout);
  std::fputs(parsed.err.c_str(), stderr);
  return parsed.exit;
}
