#include "server/http/reply_of.h"

namespace kiln {

ProgressReply progress_reply(const JobProgress& progress) {
  return {progress.stage, progress.done, progress.total, progress.fraction, progress.eta_s, progress.error};
}

ArtifactReply artifact_reply(const Artifact& artifact) {
  return {artifact.name, artifact.bytes, artifact.sha256, artifact.media_type, {}};
}

JobReply job_reply(const Job& job, const std::string& request_id) {
  JobReply reply;
  reply.id = job.id;
  reply.label = job.label;
  reply.status = to_string(job.state);
  reply.created_at = rfc3339(job.created_ms);
  reply.started_at = rfc3339(job.started_ms);
  reply.finished_at = rfc3339(job.finished_ms);
  reply.attempt = job.attempt;
  reply.cached = job.cached;
  reply.pinned = job.pinned;
  reply.recipe = job.recipe;
  if (job.progress) reply.progress = progress_reply(*job.progress);
  if (job.error) {
    reply.error = problem_of(job.error->fault);
    reply.error->status = job.error->status;
    reply.error->request_id = request_id;
  }
  for (const Artifact& artifact : job.artifacts) reply.artifacts.push_back(artifact_reply(artifact));
  return reply;
}

EventReply event_reply(const JobEvent& event) {
  return {event.id, rfc3339(event.at_ms), std::string(to_string(event.kind)), std::string(to_string(event.state)),
          event.message};
}

Reply fault_reply(const Fault& fault) { return problem_reply(problem_of(fault)); }

}  // namespace kiln
