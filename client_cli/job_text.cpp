#include "client_cli/job_text.h"

#include <cstdio>

#include "client_cli/terminal.h"

namespace kiln {
namespace {

std::string line(const char* name, const std::string& value) {
  if (value.empty()) return {};
  char text[32];
  std::snprintf(text, sizeof text, "%-10s ", name);
  return text + value + "\n";
}

std::string how_far(const JobReply& job) {
  if (!job.progress || is_terminal(job)) return {};
  char text[16];
  std::snprintf(text, sizeof text, "%.0f %% ", 100 * job.progress->fraction);
  return text + job.progress->stage;
}

std::string padded(std::string text, std::size_t width) {
  if (text.size() < width) text.append(width - text.size(), ' ');
  return text;
}

}  // namespace

std::string job_text(const JobReply& job) {
  std::string out = line("job", job.id) + line("label", job.label) +
                    line("status", job.status + (job.cached ? " (known from an earlier job)" : "")) +
                    line("progress", how_far(job)) + line("created", job.created_at) + line("started", job.started_at) +
                    line("finished", job.finished_at);
  if (job.attempt > 1) out += line("attempt", std::to_string(job.attempt));
  if (job.error) out += line("error", job.error->where + (job.error->where.empty() ? "" : ": ") + job.error->detail);
  for (const ArtifactReply& artifact : job.artifacts)
    out += line("artefact",
                artifact.name + "  " + human_bytes(static_cast<double>(artifact.bytes)) + "  " + artifact.sha256);
  return out;
}

std::string jobs_text(const std::vector<JobReply>& jobs) {
  std::string out;
  for (const JobReply& job : jobs) {
    const std::string far = how_far(job);
    out += padded(job.id, 27) + padded(job.status, 10) + " " + padded(job.created_at, 25) + job.label +
           (far.empty() ? "" : (job.label.empty() ? "" : "  ") + far) + "\n";
  }
  return out;
}

}  // namespace kiln
