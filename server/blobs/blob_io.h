#pragma once
// The small steps that reading and writing blobs share. Internal to server/blobs.

#include <cerrno>
#include <filesystem>
#include <functional>
#include <span>

#include "core/base/result.h"
#include "server/blobs/blob_writer.h"
#include "server/blobs/file_layer.h"

namespace kiln {

/// disk_full when `error` says so, else io_failed: "the server could not <doing>".
tl::unexpected<Fault> io_fault(int error, const char* doing);

/// A system call again while signals interrupt it.
template <class Call>
auto retry_interrupted(Call&& call) {
  auto result = call();
  while (result < 0 && errno == EINTR) result = call();
  return result;
}

/// Locks an open file if nobody else has, and if it still is the one of that name.
bool lock_file(int fd, const std::filesystem::path& name);

/// Unique among the machines that may share a folder.
std::string unique_name();

/// Makes the names in a folder durable.
Result<void> sync_folder(FileLayer& files, const std::filesystem::path& folder);

/// Feeds the file to `take` piece by piece.
Result<void> read_all(FileLayer& files, int fd, const std::function<void(std::span<const std::uint8_t>)>& take);

/// Hashes and syncs a file that its writer closed. Links are not followed; what is no regular file is not_found.
Result<StoredBlob> seal_file(FileLayer& files, const std::filesystem::path& file);

}  // namespace kiln
