#pragma once
// Between rows and the plain structs. Internal to server/jobs.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "server/jobs/event.h"
#include "server/jobs/job_store.h"
#include "server/jobs/sql.h"

namespace kiln::sql {

/// SELECT list of a job; read_job() expects these columns in this order.
extern const char* const kJobColumns;

/// The current row as a job, without its inputs and artefacts.
Job read_job(const Row&);

/// Inputs and artefacts of a job that read_job() began.
Result<void> read_lists(Connection&, Job&);

/// One job with everything; nothing when there is none. `keep_rows`: see Engine.
Result<std::optional<Job>> find_job(Connection&, const std::string& id, const char* keep_rows = "");

Result<void> insert_inputs(Connection&, const Job&);
Result<void> insert_artifacts(Connection&, const std::string& job_id, std::span<const Artifact>, std::int64_t fence);
Result<std::vector<Artifact>> find_artifacts(Connection&, const std::string& job_id);

struct NewEvent {
  std::string job_id;
  EventKind kind = EventKind::state;
  JobState state = JobState::queued;
  std::string message;
};
/// Appends an event and makes it the job's version.
Result<std::uint64_t> append_event(Connection&, const NewEvent&, std::int64_t now_ms);

/// A job reached a terminal state.
struct Ending {
  std::string job_id;
  JobState state = JobState::failed;
  std::string message = {};
  std::span<const Artifact> artifacts = {};
};
/// The events that tell of it; its parts are over.
Result<void> append_end(Connection&, const Ending&, std::int64_t now_ms);

}  // namespace kiln::sql
