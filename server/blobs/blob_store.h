#pragma once
// Content-addressed files: <root>/cas/ab/<sha256>. A blob is whole or not there, whenever the machine stops:
//   write <root>/tmp/x (O_EXCL, hashed on the way) -> fsync -> rename to cas/ab/<sha256> -> fsync cas/ab.
// A failed fsync means the file is lost: it is deleted, never synced again.
// Fault codes: disk_full (507), io_failed, not_found, hash_mismatch, upload_busy, offset_mismatch.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/base/sha256.h"
#include "server/blobs/file_layer.h"

namespace kiln {

struct StoredBlob {
  std::string sha256;
  std::uint64_t bytes = 0;
  bool existed = false;  // the same bytes were there before
};

/// An open blob. Keeps its bytes readable even if the blob is removed meanwhile.
class BlobReader {
 public:
  BlobReader(FileLayer& files, int fd, std::uint64_t size) : files_(&files), fd_(fd), size_(size) {}
  BlobReader(BlobReader&&) noexcept;
  BlobReader& operator=(BlobReader&&) noexcept;
  ~BlobReader();
  std::uint64_t size() const { return size_; }
  /// Fills `out` from `offset` on; fewer bytes only at the end of the blob. Any thread.
  Result<std::size_t> read(std::uint64_t offset, std::span<std::uint8_t> out) const;

 private:
  friend class BlobStore;
  FileLayer* files_;
  int fd_;
  std::uint64_t size_;
};

class BlobStore;

/// A blob on its way in. Dropped without finish(): an anonymous one vanishes, a named one can be resumed.
class BlobWriter {
 public:
  BlobWriter(BlobWriter&&) noexcept;
  BlobWriter& operator=(BlobWriter&&) = delete;
  ~BlobWriter();
  Result<void> write(std::span<const std::uint8_t> bytes);
  /// Bytes so far, those of an earlier, resumed part included.
  std::uint64_t bytes() const { return bytes_; }
  /// Makes the blob durable. A named writer refuses other bytes than its name's ("hash_mismatch", nothing stays).
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

/// One process owns a root at a time. Every function may be called from any thread.
class BlobStore {
 public:
  /// Makes the folders. `files` must outlive the store.
  static Result<std::unique_ptr<BlobStore>> open(const std::filesystem::path& root, FileLayer& files = real_files());
  ~BlobStore();

  /// A writer of bytes whose hash is not known yet.
  Result<BlobWriter> write();
  /// A writer of the blob `sha256` from `offset` on, which must be partial_bytes(sha256) ("offset_mismatch") or 0
  /// (starts anew). One at a time ("upload_busy").
  Result<BlobWriter> write_named(const std::string& sha256, std::uint64_t offset = 0);
  /// How much of an interrupted named upload is kept.
  std::uint64_t partial_bytes(const std::string& sha256) const;

  /// Moves finished files (same file system, closed by their writer) into the store, in their order. Fails with
  /// not_found for what is no regular file.
  Result<std::vector<StoredBlob>> adopt(std::span<const std::filesystem::path> files);

  Result<BlobReader> open_blob(const std::string& sha256) const;
  bool exists(const std::string& sha256) const;
  /// Where a blob lies, for hard links into a worker's folder.
  std::filesystem::path path_of(const std::string& sha256) const;
  Result<void> remove(const std::string& sha256);
  void for_each(const std::function<void(const std::string& sha256, std::uint64_t bytes)>&) const;

  /// Removes the files of anonymous writers. Only at start: afterwards they may be alive. Returns how many went.
  int remove_dead_writers();
  /// Removes named uploads that nobody writes and that are older than `age_s`. Returns how many went.
  int expire_partials(double age_s);

 private:
  friend class BlobWriter;
  struct State;
  BlobStore(std::filesystem::path root, FileLayer& files);
  Result<StoredBlob> publish(const std::filesystem::path& tmp, const std::string& sha256, std::uint64_t bytes);
  Result<void> name(const std::filesystem::path& tmp, const StoredBlob&);
  Result<void> sync_shelves(std::span<const StoredBlob>);
  Result<StoredBlob> seal(const std::filesystem::path& file) const;
  void release_name(const std::string& sha256);
  int remove_tmp(const std::function<bool(const std::filesystem::directory_entry&)>& chosen);
  std::filesystem::path root_;
  FileLayer* files_;
  std::unique_ptr<State> state_;
};

/// True for 64 lower-case hex digits, the only names this store knows.
bool is_sha256(const std::string& text);

}  // namespace kiln
