#pragma once
// Blobs as files: <root>/cas/ab/<sha256>. The root lies on this machine, or is a directory that several machines share
// (NFS 4 or another file system with rename, fsync and flock); any number of programs may use it.
//   write <root>/tmp/x (O_EXCL, hashed on the way) -> fsync -> rename to cas/ab/<sha256> -> fsync cas/ab.

#include "server/blobs/blob_store.h"

namespace kiln {

/// Makes the folders. `files` must outlive the store.
Result<std::unique_ptr<BlobStore>> open_file_blobs(const std::filesystem::path& root, FileLayer& files = real_files());

}  // namespace kiln
