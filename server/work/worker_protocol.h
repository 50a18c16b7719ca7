#pragma once
// What supervisor and worker tell each other: job.json down, JSON lines on descriptor 3 up, an exit code at the end.
//   {"progress":{"stage","done","total","fraction"[,"error"]}}   {"artifact":{"name","media_type"}}
//   {"fault":{"code","message","where"}}               {"done":true}
//   {"checkpoint":"..."}    what the next worker of the same job gets back in its order (core/bake/checkpoint.h)

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "core/base/progress.h"
#include "core/base/result.h"
#include "server/jobs/job.h"

namespace kiln {

inline constexpr const char* kWorkerWord = "bake-worker";  // argv[1] of a worker; argv[2] is its folder
inline constexpr int kWorkerPipe = 3;

enum WorkerExit : int { kExitDone = 0, kExitRefused = 65, kExitInternal = 70, kExitCanceled = 75 };

enum class WorkerMode { bake, plan };

/// Contents of job.json. Inputs lie in the folder as inputs/0 (the scene), inputs/1, ...; results go to out/.
struct WorkerOrder {
  JobInputs inputs;
  std::string recipe;  // canonical JSON
  WorkerMode mode = WorkerMode::bake;
  int threads = 0;
  int parent = 0;                // process id of the supervisor: a worker ends when it is gone
  std::string checkpoint;        // of an earlier worker of this job; empty: none
  bool require_sandbox = false;  // refuse to work where the kernel has not all of server/work/sandbox.h
};

/// Path of an input within the folder, by its place: 0 the scene, 1.. the resources, then the environment.
std::string input_path(std::size_t place);

std::string order_json(const WorkerOrder&);
Result<WorkerOrder> parse_order(std::string_view json);

struct WorkerDone {};
struct WorkerArtifact {
  std::string name, media_type;
};
struct WorkerCheckpoint {
  std::string text;
};
using WorkerLine = std::variant<ProgressEvent, WorkerArtifact, WorkerCheckpoint, Fault, WorkerDone>;

std::string line_json(const WorkerLine&);
/// Nothing for anything that is not exactly one of these lines: the worker is not to be trusted then.
std::optional<WorkerLine> parse_line(std::string_view line);

/// True for names a worker may give: letters, digits, dot, dash, underscore; no leading dot; 1..64 letters.
bool is_artifact_name(std::string_view name);

}  // namespace kiln
