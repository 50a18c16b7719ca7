#include "server/jobs/job.h"

#include <array>

#include "server/jobs/event.h"

namespace kiln {
namespace {

constexpr std::array<std::string_view, 5> kStates{"queued", "running", "succeeded", "failed", "canceled"};
constexpr std::array<std::string_view, 5> kEvents{"state", "progress", "log", "artifact", "done"};

}  // namespace

std::string_view to_string(JobState state) { return kStates.at(static_cast<std::size_t>(state)); }

std::string_view to_string(EventKind kind) { return kEvents.at(static_cast<std::size_t>(kind)); }

std::optional<JobState> parse_job_state(std::string_view text) {
  for (std::size_t i = 0; i < kStates.size(); ++i) {
    if (kStates[i] == text) return static_cast<JobState>(i);
  }
  return std::nullopt;
}

std::optional<EventKind> parse_event_kind(std::string_view text) {
  for (std::size_t i = 0; i < kEvents.size(); ++i) {
    if (kEvents[i] == text) return static_cast<EventKind>(i);
  }
  return std::nullopt;
}

}  // namespace kiln
