#include "server/work/upload_desk.h"

#include "core/base/sha256.h"
#include "server/jobs/ids.h"

namespace kiln {
namespace {

std::string id_of(const PartialUpload& wanted) {
  if (wanted.expected.empty()) return random_token();
  const std::string text = wanted.tenant + "\n" + wanted.expected + "\n" + std::to_string(wanted.length);
  return sha256_hex({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}).substr(0, 32);
}

}  // namespace

class UploadDesk::Piece final : public UploadPiece {
 public:
  Piece(UploadDesk& desk, PieceWriter writer) : desk_(&desk), writer_(std::move(writer)) {}
  Result<void> write(std::span<const std::uint8_t> bytes) override { return writer_.write(bytes); }
  void all_or_nothing() override { writer_.all_or_nothing(); }
  Result<PartialUpload> keep() override {
    KILN_TRY(kept, writer_.keep());
    return desk_->complete(std::move(kept));
  }

 private:
  UploadDesk* desk_;
  PieceWriter writer_;
};

Result<PartialUpload> UploadDesk::begin(PartialUpload wanted) {
  wanted.id = id_of(wanted);
  return uploads_.begin(wanted, kMostUnfinished);
}

Result<PartialUpload> UploadDesk::find(const std::string& id, const std::string& tenant) {
  KILN_TRY(upload, uploads_.find(id, tenant));
  auto completed = complete(upload);
  if (!completed && completed.error().code == "upload_busy") return upload;  // somebody is completing it
  return completed;
}

Result<std::unique_ptr<UploadPiece>> UploadDesk::append(const PartialUpload& wanted, std::uint64_t offset) {
  KILN_TRY(upload, find(wanted.id, wanted.tenant));
  if (upload.done) return fault("offset_mismatch", "this upload is complete", upload.id);
  KILN_TRY(writer, uploads_.append(upload, offset));
  return std::make_unique<Piece>(*this, std::move(writer));
}

Result<void> UploadDesk::remove(const std::string& id, const std::string& tenant) {
  KILN_TRY(upload, uploads_.find(id, tenant));
  return uploads_.remove(upload);
}

Result<PartialUpload> UploadDesk::complete(PartialUpload upload) {
  if (upload.done || upload.offset < upload.length) return upload;
  KILN_TRY(stored, register_(upload.tenant, [&] { return uploads_.store(upload); }));
  if (auto noted = uploads_.finish(upload, stored.sha256); !noted) return tl::make_unexpected(noted.error());
  return uploads_.find(upload.id, upload.tenant);
}

}  // namespace kiln
