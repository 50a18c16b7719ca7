#pragma once
// The folder that one worker sees: <data>/work/<job>.<token>/ with job.json, inputs/0.., ranges/, out/, worker.log.

#include <filesystem>

#include "server/blobs/blob_store.h"
#include "server/work/worker_protocol.h"

namespace kiln {

/// Made and filled on construction through make(), removed with everything in it at the end.
class WorkFolder {
 public:
  /// Inputs are links to blobs or copies of them. Fails with disk_full, io_failed, blobs_unavailable, or asset_lost
  /// when a blob is gone.
  static Result<WorkFolder> make(const std::filesystem::path& folder, const BlobStore&, const WorkerOrder&);
  WorkFolder(WorkFolder&&) noexcept;
  WorkFolder& operator=(WorkFolder&&) = delete;
  ~WorkFolder();

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path result(const std::string& name) const { return path_ / "out" / name; }

 private:
  explicit WorkFolder(std::filesystem::path path) : path_(std::move(path)) {}
  std::filesystem::path path_;
};

/// Removes all work folders: at start, when nobody works.
void remove_work_folders(const std::filesystem::path& work);

}  // namespace kiln
