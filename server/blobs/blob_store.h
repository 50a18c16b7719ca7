#pragma once
// Content-addressed bytes: a blob is named by its SHA-256, and is whole or not there, whenever a machine stops. One
// interface, three places: files of this machine or a shared directory (file_blobs.h), an S3 store (s3_blobs.h); one
// conformance suite (tests/server/blobs).
// Fault codes: disk_full (507), io_failed, not_found, hash_mismatch, upload_busy, offset_mismatch, and of an S3 store
// blobs_unavailable (503, try again), blobs_refused (wrong credentials, no such bucket), too_large.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "server/blobs/blob_writer.h"
#include "server/blobs/file_layer.h"

namespace kiln {

/// An open blob. Any thread may read.
class BlobReader {
 public:
  /// Where its bytes come from.
  class Source {
   public:
    virtual ~Source() = default;
    virtual Result<std::size_t> read(std::uint64_t offset, std::span<std::uint8_t> out) = 0;
  };
  BlobReader(std::unique_ptr<Source> source, std::uint64_t size) : source_(std::move(source)), size_(size) {}
  std::uint64_t size() const { return size_; }
  /// Fills `out` from `offset` on; fewer bytes only at the end of the blob.
  Result<std::size_t> read(std::uint64_t offset, std::span<std::uint8_t> out) const {
    return source_->read(offset, out);
  }

 private:
  std::unique_ptr<Source> source_;
  std::uint64_t size_;
};

struct BlobEntry {
  std::string sha256;
  std::uint64_t bytes = 0;
  double age_s = 0;  // since it was stored last
};

/// Every function may be called from any thread. Bytes on their way in lie in the spool, a folder `tmp` of this machine
/// or of a shared directory; each file there is locked by whoever writes it (flock), so that a file without a lock is
/// one whose writer is gone.
class BlobStore {
 public:
  virtual ~BlobStore() = default;

  /// A writer of bytes whose hash is not known yet.
  Result<BlobWriter> write();
  /// A writer of the blob `sha256` from `offset` on, which must be partial_bytes() of the same tenant
  /// ("offset_mismatch") or 0 (starts anew). One of a tenant at a time ("upload_busy"). Nobody goes on with the bytes
  /// of another tenant: whoever knew a hash and the last bytes of a file would have all of it. A tenant is a word.
  Result<BlobWriter> write_named(const std::string& sha256, std::uint64_t offset = 0, const std::string& tenant = "");
  /// How much of a tenant's interrupted named upload is kept in this spool.
  std::uint64_t partial_bytes(const std::string& sha256, const std::string& tenant = "") const;
  /// Removes files of anonymous writers that are gone. Returns how many went.
  int remove_dead_writers();
  /// Removes named uploads, and files of those in pieces, that nobody writes and that are older than `age_s`. Returns
  /// how many files went.
  int expire_partials(double age_s);

  /// Moves finished files (closed by their writer, on the spool's file system) into the store, in their order. Fails
  /// with not_found for what is no regular file.
  virtual Result<std::vector<StoredBlob>> adopt(std::span<const std::filesystem::path> files) = 0;
  virtual Result<BlobReader> open_blob(const std::string& sha256) const = 0;
  bool exists(const std::string& sha256) const { return open_blob(sha256).has_value(); }
  /// Puts the bytes at `target`, which must not be there: input of a worker.
  virtual Result<void> place(const std::string& sha256, const std::filesystem::path& target) const = 0;
  /// Removing what is not there is done already.
  virtual Result<void> remove(const std::string& sha256) = 0;
  virtual Result<void> for_each(const std::function<void(const BlobEntry&)>&) const = 0;
  /// The job store that this place belongs to: `claimant` when it was nobody's until now. What no job of its store
  /// needs is removed from a place, so two stores must not share one.
  virtual Result<std::string> owner(const std::string& claimant) = 0;
  /// Fails when blobs cannot be stored now.
  virtual Result<void> check() = 0;

  /// The folder whose disk fills up with what is stored or on its way.
  const std::filesystem::path& folder() const { return folder_; }

 protected:
  /// `folder` holds, or will hold, the spool `tmp`.
  BlobStore(std::filesystem::path folder, FileLayer& files) : folder_(std::move(folder)), files_(&files) {}
  /// Stores a synced file of the spool under its hash; the file is gone afterwards.
  virtual Result<StoredBlob> publish(const std::filesystem::path& tmp, const std::string& sha256,
                                     std::uint64_t bytes) = 0;
  /// Makes durable that a blob is there: whoever published it may have died on the way.
  virtual Result<void> settle(const std::string& sha256) = 0;
  FileLayer& files() const { return *files_; }

 private:
  friend class BlobWriter;
  friend class PartialUploads;
  friend class PieceWriter;
  std::filesystem::path part_of(const std::string& sha256, const std::string& tenant) const;
  int remove_unlocked(const std::function<bool(const std::filesystem::directory_entry&)>& chosen);
  std::filesystem::path folder_;
  FileLayer* files_;
};

/// True for 64 lower-case hex digits, the only names a store knows.
bool is_sha256(const std::string& text);

}  // namespace kiln
