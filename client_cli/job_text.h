#pragma once
// Jobs as text for people.

#include <string>
#include <vector>

#include "server/api/job.h"

namespace kiln {

/// Everything about one job, a line for each fact.
std::string job_text(const JobReply&);
/// A table with a line for each job: id, status, how far, when, label.
std::string jobs_text(const std::vector<JobReply>&);

}  // namespace kiln
