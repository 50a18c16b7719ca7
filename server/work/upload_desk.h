#pragma once
// Uploads in pieces, from the first byte to the blob that jobs may name (server/blobs/partial_upload.h).

#include <functional>
#include <memory>
#include <string>

#include "server/blobs/partial_upload.h"

namespace kiln {

/// Bytes of one piece. Dropped without keep(): what came counts, unless all of it counts together.
class UploadPiece {
 public:
  virtual ~UploadPiece() = default;
  virtual Result<void> write(std::span<const std::uint8_t> bytes) = 0;
  virtual void all_or_nothing() = 0;
  /// Makes them durable; with the last one the upload becomes a blob.
  virtual Result<PartialUpload> keep() = 0;
};

class UploadDesk {
 public:
  /// Runs `store`, which makes a blob, and notes that the tenant has it.
  using Register =
      std::function<Result<StoredBlob>(const std::string& tenant, const std::function<Result<StoredBlob>()>& store)>;
  UploadDesk(BlobStore& blobs, Register note) : uploads_(blobs), register_(std::move(note)) {}

  /// `wanted` has tenant, length, metadata, and expected if it is known: then the same file of the same tenant is the
  /// same upload, so that a client that forgot its address goes on by asking again. "quota" when the tenant has
  /// kMostUnfinished already.
  Result<PartialUpload> begin(PartialUpload wanted);
  /// Completes what a crash left nearly complete. While somebody else completes it, all bytes are there, not `done`.
  Result<PartialUpload> find(const std::string& id, const std::string& tenant);
  Result<std::unique_ptr<UploadPiece>> append(const PartialUpload& id_and_tenant, std::uint64_t offset);
  Result<void> remove(const std::string& id, const std::string& tenant);

  static constexpr int kMostUnfinished = 100;  // of a tenant

 private:
  class Piece;
  Result<PartialUpload> complete(PartialUpload);
  PartialUploads uploads_;
  Register register_;
};

}  // namespace kiln
