#pragma once
// What supervisor and worker tell each other: job.json down, JSON lines on descriptor 3 up, an exit code at the end.
//   {"progress":{"stage","done","total","fraction"[,"error"]}}   {"artifact":{"name","media_type"}}
//   {"fault":{"code","message","where"}}               {"done":true}
//   {"checkpoint":"..."}    what the next worker of the same job gets back in its order (core/bake/checkpoint.h)
// Of a bake whose loops are shared (shared_bake.h, part_desk.h), on which the supervisor answers on descriptor 0:
//   {"share":{"loop","name","journal_bytes","cuts":[...]}}    others may compute the ranges between these cuts
//   {"next":loop}                                   what now?   {"range":{"loop","first","last"},"file"}, "" to compute
//   {"made":{"range","file"}}                       a range that it computed itself, in out/

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/base/progress.h"
#include "core/base/result.h"
#include "server/jobs/job.h"

namespace kiln {

inline constexpr const char* kWorkerWord = "bake-worker";  // argv[1] of a worker; argv[2] is its folder
inline constexpr int kWorkerPipe = 3;
inline constexpr std::uint64_t kMostJournal = 4ULL << 30;  // bytes: a longer one ends the sharing of its bake

enum WorkerExit : int { kExitDone = 0, kExitRefused = 65, kExitInternal = 70, kExitCanceled = 75 };

enum class WorkerMode { bake, plan, part };

/// Items [first, last) of a loop, counted from 0 within a pass (core/base/shared_loop.h).
struct LoopRange {
  std::uint64_t loop = 0, first = 0, last = 0;
  friend bool operator==(const LoopRange&, const LoopRange&) = default;
};

/// When ranges of a bake's loops go to others.
struct Sharing {
  double least_s = 0;  // a range takes at least so long; 0: none is given away
  double repeats = 8;  // and so many times what its worker has to do again: the overhead is at most one part in so many
};

/// Contents of job.json. Inputs lie in the folder as inputs/0 (the scene), inputs/1, ...; results go to out/.
struct WorkerOrder {
  JobInputs inputs;
  std::string recipe;  // canonical JSON
  WorkerMode mode = WorkerMode::bake;
  int threads = 0;
  int parent = 0;          // process id of the supervisor: a worker ends when it is gone
  std::string checkpoint;  // of an earlier worker of this job; empty: none
  Sharing sharing;
  std::vector<LoopRange> known;    // that an earlier worker of this job gave away
  std::optional<LoopRange> range;  // mode part: what to compute
  std::string journal;             // mode part: blob of what the loops before it made, as inputs/journal
  bool require_sandbox = false;    // refuse to work where the kernel has not all of server/work/sandbox.h
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
struct WorkerShare {
  std::uint64_t loop = 0;
  std::string name;
  std::uint64_t journal_bytes = 0;  // of out/journal
  std::vector<std::uint64_t> cuts;  // ascending: n + 1 of them around n ranges
};
struct WorkerNext {
  std::uint64_t loop = 0;
};
struct WorkerMade {
  LoopRange range;
  std::string file;  // in out/; empty: it could not be written
};
using WorkerLine = std::variant<ProgressEvent, WorkerArtifact, WorkerCheckpoint, WorkerShare, WorkerNext, WorkerMade,
                                Fault, WorkerDone>;

std::string line_json(const WorkerLine&);
/// Nothing for anything that is not exactly one of these lines: the worker is not to be trusted then.
std::optional<WorkerLine> parse_line(std::string_view line);

/// What to do with a range of the loop that was shared last.
struct RangeReply {
  LoopRange range;
  std::string file;  // where its items lie; empty: compute it
};
std::string reply_json(const RangeReply&);
Result<RangeReply> parse_reply(std::string_view line);

/// A part's order as the store keeps it: the range, and the checkpoint of the pass that it belongs to.
struct PartOrder {
  LoopRange range;
  std::string checkpoint;
};
std::string part_json(const PartOrder&);
Result<PartOrder> parse_part(std::string_view json);

/// True for names a worker may give: letters, digits, dot, dash, underscore; no leading dot; 1..64 letters.
bool is_artifact_name(std::string_view name);

}  // namespace kiln
