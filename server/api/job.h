#pragma once
// A job as its users see it: typed here, JSON on the wire (HTTP, server-sent events, `kiln --json`).

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "server/api/problem.h"

namespace kiln {

struct ArtifactReply {
  std::string name;
  std::uint64_t bytes = 0;
  std::string sha256;
  std::string media_type;
  std::string url;  // path on the server: /v1/jobs/{id}/artifacts/{name}; made from the job when empty
};

struct ProgressReply {
  std::string stage;
  std::uint64_t done = 0;  // of total, in units of the stage
  std::uint64_t total = 0;
  double fraction = 0;          // of the whole job, [0, 1]
  std::optional<double> eta_s;  // seconds to go, when known
  std::optional<double> error;  // current estimate of relRMSE, when known
};

struct JobReply {
  std::string id;
  std::string label;
  std::string status;                               // queued | running | succeeded | failed | canceled
  std::string created_at, started_at, finished_at;  // RFC 3339 UTC; empty: not yet (null on the wire)
  int attempt = 0;
  bool cached = false;
  bool pinned = false;        // kept until it is unpinned
  std::string recipe = "{}";  // canonical JSON
  std::optional<ProgressReply> progress;
  std::optional<Problem> error;
  std::vector<ArtifactReply> artifacts;
};

/// One thing that happened to a job.
struct EventReply {
  std::uint64_t id = 0;
  std::string at;       // RFC 3339 UTC
  std::string kind;     // state | log | artifact | done
  std::string status;   // after it
  std::string message;  // why, or the line, or the artefact's name; may be empty
};

struct JobListReply {
  std::vector<JobReply> jobs;
  std::string next_cursor;  // empty: no further page
};

bool is_terminal(const JobReply&);

/// Milliseconds since 1970 as "2026-11-22T14:05:09.123Z"; 0 and less give "".
std::string rfc3339(std::int64_t unix_ms);

std::string artifact_url(std::string_view job, std::string_view name);

std::string job_json(const JobReply&);
std::string job_list_json(const JobListReply&);
std::string artifact_list_json(std::string_view job, const std::vector<ArtifactReply>&);

std::string history_json(std::string_view job, const std::vector<EventReply>&);

/// The data of the server-sent events `progress`, `artifact` and `log`: the object plus "job".
std::string progress_event_json(std::string_view job, const ProgressReply&);
std::string artifact_event_json(std::string_view job, const ArtifactReply&);
std::string log_event_json(std::string_view job, std::string_view line);

/// What a client reads back. Unknown members are ignored, so an old client reads a newer server.
/// Fails  code `bad_reply` when a member that every job has is missing or of another type.
Result<JobReply> parse_job(std::string_view json);
Result<JobListReply> parse_job_list(std::string_view json);
Result<ProgressReply> parse_progress(std::string_view json);

}  // namespace kiln
