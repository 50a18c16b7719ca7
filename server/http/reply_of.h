#pragma once
// The service's values as replies.

#include "server/api/job.h"
#include "server/http/message.h"
#include "server/work/service.h"

namespace kiln {

JobReply job_reply(const Job&);
ProgressReply progress_reply(const JobProgress&);
ArtifactReply artifact_reply(const Artifact&);
EventReply event_reply(const JobEvent&);
Reply fault_reply(const Fault&);

}  // namespace kiln
