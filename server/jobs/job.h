#pragma once
// A job as everyone sees it: plain data.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"

namespace kiln {

/// queued -> running -> succeeded | failed | canceled; running goes back to queued after a lost or drained worker.
enum class JobState { queued, running, succeeded, failed, canceled };

std::string_view to_string(JobState);
std::optional<JobState> parse_job_state(std::string_view);
/// Terminal states never change.
constexpr bool is_terminal(JobState s) { return s != JobState::queued && s != JobState::running; }

/// A blob under a name that a person or a file gave it.
struct NamedBlob {
  std::string name;
  std::string sha256;
  friend bool operator==(const NamedBlob&, const NamedBlob&) = default;
};

struct JobInputs {
  NamedBlob scene;
  std::vector<NamedBlob> resources;      // files that a .gltf names, by URI after percent-decoding
  std::optional<NamedBlob> environment;  // .hdr or .exr
};

struct Artifact {
  std::string name;        // "scene.glb"
  std::string media_type;  // "model/gltf-binary"
  std::string sha256;      // 64 hex digits, the blob's name
  std::uint64_t bytes = 0;
};

struct JobProgress {
  std::string stage;
  std::uint64_t done = 0, total = 0;  // in units of the stage
  double fraction = 0;                // of the whole job, [0, 1], never falling within one attempt
  std::optional<double> eta_s;        // absent while unknown
  std::optional<double> error = {};   // relRMSE of the last pass, where a bake has passes; told, not kept in the store
};

/// Why a job failed: the fault and the status that an HTTP answer would carry (422 for the input's own faults).
struct JobError {
  Fault fault;
  int status = 500;
};

/// A range of a loop of another job, for whoever has time (server/work/part_desk.h). It ends with that job, if not
/// before.
struct JobPart {
  std::string parent;   // that job's id
  std::string order;    // what to compute, JSON
  std::string journal;  // blob: what the loops before it made
};

/// Times are milliseconds since 1970 (UTC) by the store's clock; 0 stands for "not yet".
struct Job {
  std::string id;  // ULID: 26 letters, sorts by creation time
  JobState state = JobState::queued;
  std::string tenant;  // whose it is; empty where nobody is told apart
  std::string label;
  JobInputs inputs;
  std::string recipe;       // canonical JSON
  std::string content_key;  // equal keys give equal artefacts
  bool force = false;       // bake even if the result is known
  bool cached = false;      // the artefacts come from an earlier job
  bool cancel_requested = false;
  bool pinned = false;  // kept until somebody unpins it
  int attempt = 0;      // 1 while it runs for the first time
  int crashes = 0;      // attempts that ended by a signal
  int retries = 0;      // attempts lost to the machine (disk full, spawn failed)
  std::int64_t created_ms = 0, started_ms = 0, finished_ms = 0;
  std::uint64_t version = 0;            // id of its newest event: grows with every change of the row
  std::optional<JobProgress> progress;  // while running
  std::optional<JobError> error;        // exactly when failed
  std::vector<Artifact> artifacts;      // exactly when succeeded
  std::optional<JobPart> part;          // when it is no bake of its own
  std::uint64_t memory_mb = 0;          // that it may use; 0: of a job from before this was kept
};

}  // namespace kiln
