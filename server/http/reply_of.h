#pragma once
// The service's values as replies.

#include "server/api/job.h"
#include "server/http/message.h"
#include "server/work/service.h"

namespace kiln {

/// The error of a failed job carries the id of the request that it answers, as every problem does.
JobReply job_reply(const Job&, const std::string& request_id = {});
ProgressReply progress_reply(const JobProgress&);
ArtifactReply artifact_reply(const Artifact&);
EventReply event_reply(const JobEvent&);
Reply fault_reply(const Fault&);

}  // namespace kiln
