#pragma once
// Bakes on a server, as the commands put them together.

#include "client_cli/bake_result.h"
#include "client_cli/commands.h"
#include "client_cli/remote.h"

namespace kiln {

/// Recipe and scene of a command, read for a server.
Outcome<JobInput> job_input(const std::string& input, const RecipeOptions&, const std::string& idempotency_key);

/// Watches with a progress bar. A failed or canceled job is shown and is no Failure; an interrupt detaches and says how
/// to cancel.
Outcome<JobReply> watch_with_bar(ServerLink&, const std::string& id);

/// Downloads the named artefact, or all when `name` is empty, into `folder`.
Outcome<BakedFiles> download_all(ServerLink&, const JobReply&, const std::string& folder, const std::string& name);

/// Why a job ended badly, on stderr.
void show_end(const JobReply&, const Session&);

/// Submit, watch, download.
Outcome<ExitCode> bake_remotely(const BakeOptions&, Session&);

}  // namespace kiln
