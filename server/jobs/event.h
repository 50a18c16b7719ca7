#pragma once
// What happened to a job, in order. Durable events have increasing ids across all jobs: a reader that knows the last
// id it saw can ask for the rest. Progress is not kept: only the newest counts.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "server/jobs/job.h"

namespace kiln {

enum class EventKind { state, progress, log, artifact, done };

std::string_view to_string(EventKind);
std::optional<EventKind> parse_event_kind(std::string_view);

struct JobEvent {
  std::uint64_t id = 0;  // 0 for progress, which is not replayed: write no `id:` line for it
  std::string job_id;
  EventKind kind = EventKind::state;
  std::int64_t at_ms = 0;
  JobState state = JobState::queued;    // the state after the event
  std::string message;                  // log: the line; state: why, when there is something to say
  std::optional<JobProgress> progress;  // progress only
  std::optional<Artifact> artifact;     // artifact only
};

}  // namespace kiln
