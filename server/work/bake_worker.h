#pragma once
// The worker's own main: one job, alone in its process.

namespace kiln {

/// argv: the word, FOLDER (`kilnd bake-worker FOLDER`). Reads FOLDER/job.json and inputs, writes FOLDER/out, tells on
/// descriptor 3 (see worker_protocol.h). TERM stops it; it dies with its supervisor. Returns the exit code; never
/// throws.
int bake_worker_main(int argc, char** argv);

}  // namespace kiln
