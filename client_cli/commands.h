#pragma once
// The commands. Each stands in a file of its own: command_eval.cpp and so on.

#include "client_cli/exit_code.h"
#include "client_cli/failure.h"
#include "client_cli/interrupt.h"
#include "client_cli/options.h"
#include "client_cli/terminal.h"

namespace kiln {

/// What every command is given beside its own options.
struct Session {
  CommonOptions common;
  Terminal terminal;
  Interrupt& interrupt;
};

/// Data goes to stdout, talk to stderr. A Failure is shown by the caller.
Outcome<ExitCode> run(const BakeOptions&, Session&);
Outcome<ExitCode> run(const SubmitOptions&, Session&);
Outcome<ExitCode> run(const WatchOptions&, Session&);
Outcome<ExitCode> run(const GetOptions&, Session&);
Outcome<ExitCode> run(const ListOptions&, Session&);
Outcome<ExitCode> run(const CancelOptions&, Session&);
Outcome<ExitCode> run(const PinOptions&, Session&);
Outcome<ExitCode> run(const RemoveOptions&, Session&);
Outcome<ExitCode> run(const PlanOptions&, Session&);
Outcome<ExitCode> run(const InspectOptions&, Session&);
Outcome<ExitCode> run(const EvalOptions&, Session&);
Outcome<ExitCode> run(const TruthOptions&, Session&);
Outcome<ExitCode> run(const CompareOptions&, Session&);
Outcome<ExitCode> run(const PointsOptions&, Session&);
Outcome<ExitCode> run(const PresetsOptions&, Session&);
Outcome<ExitCode> run(const DemoSceneOptions&, Session&);
Outcome<ExitCode> run(const OpenOptions&, Session&);
Outcome<ExitCode> run(const CompletionOptions&, Session&);

}  // namespace kiln
