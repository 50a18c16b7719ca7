#pragma once
// The newest checkpoint of each job: <data>/checkpoints/<job>. It outlives the job's worker and the server, by kill -9
// as well; a power cut may cost it, and then the bake begins anew. Failing to write one is no trouble for its job.

#include <filesystem>
#include <string>

#include "server/jobs/job_store.h"

namespace kiln {

class CheckpointFile {
 public:
  CheckpointFile(const std::filesystem::path& folder, const std::string& job_id) : path_(folder / job_id) {}

  std::string load() const;  // empty when there is none
  void save(const std::string& text) const;
  void remove() const;

 private:
  std::filesystem::path path_;
};

/// Removes those of jobs that have ended or are gone: at start, when nobody works.
void remove_stale_checkpoints(const std::filesystem::path& folder, JobStore&);

}  // namespace kiln
