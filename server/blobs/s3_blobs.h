#pragma once
// Blobs as objects `ab/<sha256>` of one bucket of an S3-compatible store. The spool stays on this machine. Hashes are
// verified both ways: the store checks what it gets against the signed hash, we check what a worker gets, and what a
// reader gets from beginning to end. Objects have at most 5 GiB ("too_large").

#include <chrono>

#include "server/blobs/blob_store.h"

namespace kiln {

struct S3Options {
  std::string endpoint;  // "https://s3.example.org": scheme, host, port
  std::string bucket;
  std::string region = "us-east-1";
  std::string key, secret;
  std::chrono::milliseconds connect_timeout{5000};
  std::chrono::seconds stall_timeout{30};  // less than 1 kB/s for so long ends a try
  int tries = 4;
  std::chrono::milliseconds first_pause{200};  // twice as long each time
};

/// `spool`: a folder of this machine for bytes on their way in. The bucket must be there ("blobs_refused").
Result<std::unique_ptr<BlobStore>> open_s3_blobs(const S3Options&, const std::filesystem::path& spool,
                                                 FileLayer& files = real_files());

}  // namespace kiln
