#pragma once
// Uploads that come in pieces, each acknowledged for good: a file of bytes and a record of how many of them count, both
// in the spool. What was acknowledged survives kill -9 and power loss; bytes behind it are forgotten. One writer at a
// time: the file of bytes is locked while somebody writes it.
//   tmp/up.<id>  bytes      tmp/up.<id>.info  record      tmp/up.<id>.done  record of one that has become a blob
//   tmp/up.begin  locked while one begins
// Fault codes: those of blob_store.h, and quota.

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "core/base/result.h"
#include "server/blobs/blob_store.h"

namespace kiln {

struct PartialUpload {
  std::string id;              // 32 hex digits
  std::string tenant;          // whose it is; a word
  std::uint64_t length = 0;    // of the whole, in bytes
  std::uint64_t offset = 0;    // bytes that are here for good
  std::string expected;        // SHA-256 of the whole if its sender told it; else empty
  std::string metadata;        // the sender's own words, one line
  std::string sha256;          // of the whole, once all has come
  bool done = false;           // it has become a blob, and the job store knows it
  std::int64_t expires_s = 0;  // seconds since 1970: nobody may go on with it after that
};

/// The right to add bytes to one upload.
class PieceWriter {
 public:
  PieceWriter(PieceWriter&&) noexcept;
  PieceWriter& operator=(PieceWriter&&) = delete;
  /// Keeps what was written, unless all of it counts together.
  ~PieceWriter();
  /// "too_large" beyond the announced length. What was written counts, some of it at a time.
  Result<void> write(std::span<const std::uint8_t> bytes);
  /// From here on what is written counts by keep() alone, all of it or nothing.
  void all_or_nothing() { together_ = true; }
  /// Makes the bytes durable and counts them. The last call. A failed sync means that the upload is lost.
  Result<PartialUpload> keep();

 private:
  friend class PartialUploads;
  PieceWriter(class PartialUploads& uploads, PartialUpload record, int fd);
  Result<void> count();
  void close();
  PartialUploads* uploads_;
  PartialUpload record_;
  int fd_;
  std::uint64_t written_;  // bytes of the file, counted or not
  bool together_ = false;
};

/// Every function may be called from any thread, and from any program that shares the spool. An upload of another
/// tenant is not_found.
class PartialUploads {
 public:
  explicit PartialUploads(BlobStore& blobs) : blobs_(&blobs) {}
  /// How long after its last byte, or after it became a blob, an upload is remembered.
  static constexpr std::chrono::seconds kKept{24 * 3600};

  /// Makes the upload, or finds the one that has this id already. "quota" when `most` of its tenant's wait for bytes,
  /// however many begin at once and in however many programs; 0: any number may.
  Result<PartialUpload> begin(const PartialUpload&, int most = 0);
  Result<PartialUpload> find(const std::string& id, const std::string& tenant) const;
  /// "offset_mismatch" unless `offset` is what counts so far, "upload_busy" while somebody writes it.
  Result<PieceWriter> append(const PartialUpload&, std::uint64_t offset);
  /// Stores the blob of an upload all of whose bytes are here. Again after a crash between this and finish().
  /// "hash_mismatch" when they are not the expected ones: then the upload is gone.
  Result<StoredBlob> store(const PartialUpload&);
  /// Once the blob is known to the job store.
  Result<void> finish(const PartialUpload&, const std::string& sha256);
  Result<void> remove(const PartialUpload&);
  /// How many of a tenant's uploads wait for bytes.
  int unfinished(const std::string& tenant) const;

 private:
  friend class PieceWriter;
  Result<int> lock_begin() const;
  Result<PartialUpload> make(const PartialUpload&);
  std::filesystem::path file(const std::string& id, const char* suffix) const;
  Result<PartialUpload> read_record(const std::filesystem::path&) const;
  Result<void> write_record(const PartialUpload&);
  Result<int> open_locked(const std::string& id, int flags) const;
  void forget(const std::string& id);
  BlobStore* blobs_;
};

}  // namespace kiln
