#pragma once
// A blob on its way in: bytes go to a file of the spool and are hashed on the way.

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "core/base/result.h"
#include "core/base/sha256.h"

namespace kiln {

struct StoredBlob {
  std::string sha256;
  std::uint64_t bytes = 0;
  bool existed = false;  // the same bytes were there before
};

class BlobStore;

/// Dropped without finish(): an anonymous one vanishes, a named one can be resumed.
class BlobWriter {
 public:
  BlobWriter(BlobWriter&&) noexcept;
  BlobWriter& operator=(BlobWriter&&) = delete;
  ~BlobWriter();
  Result<void> write(std::span<const std::uint8_t> bytes);
  /// Bytes so far, those of an earlier, resumed part included.
  std::uint64_t bytes() const { return bytes_; }
  /// Makes the blob durable. A named writer refuses other bytes than its name's ("hash_mismatch", nothing stays).
  /// A failed sync means the file is lost: it is deleted, never synced again.
  Result<StoredBlob> finish();

 private:
  friend class BlobStore;
  BlobWriter(BlobStore& store, std::filesystem::path tmp, int fd, std::string expected);
  void discard();
  BlobStore* store_;
  std::filesystem::path tmp_;
  int fd_;
  std::string expected_;  // sha256 given by the uploader, or empty
  Sha256 hash_;
  std::uint64_t bytes_ = 0;
};

}  // namespace kiln
