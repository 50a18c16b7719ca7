#include "server/blobs/blob_writer.h"

#include <utility>

#include "server/blobs/blob_io.h"
#include "server/blobs/blob_store.h"

namespace kiln {

BlobWriter::BlobWriter(BlobStore& store, std::filesystem::path tmp, int fd, std::string expected)
    : store_(&store), tmp_(std::move(tmp)), fd_(fd), expected_(std::move(expected)) {}

BlobWriter::BlobWriter(BlobWriter&& other) noexcept
    : store_(other.store_),
      tmp_(std::move(other.tmp_)),
      fd_(std::exchange(other.fd_, -1)),
      expected_(std::move(other.expected_)),
      hash_(std::move(other.hash_)),
      bytes_(other.bytes_) {}

BlobWriter::~BlobWriter() {
  if (fd_ < 0) return;
  if (expected_.empty()) {
    discard();
  } else {  // kept: the rest may still come
    store_->files().close(fd_);
  }
}

void BlobWriter::discard() {
  store_->files().unlink(tmp_);  // while the lock holds: nobody else may have taken the name
  store_->files().close(std::exchange(fd_, -1));
}

Result<void> BlobWriter::write(std::span<const std::uint8_t> bytes) {
  if (fd_ < 0) return fault("io_failed", "this upload failed before");
  std::size_t written = 0;
  while (written < bytes.size()) {
    const ssize_t put =
        retry_interrupted([&] { return store_->files().write(fd_, bytes.data() + written, bytes.size() - written); });
    if (put < 0) {
      auto failed = io_fault(errno, "write a blob");
      discard();
      return failed;
    }
    hash_.update(bytes.subspan(written, static_cast<std::size_t>(put)));
    written += static_cast<std::size_t>(put);
    bytes_ += static_cast<std::uint64_t>(put);
  }
  return {};
}

Result<StoredBlob> BlobWriter::finish() {
  if (fd_ < 0) return fault("io_failed", "this upload failed before");
  const std::string sha256 = hash_.hex();
  if (!expected_.empty() && sha256 != expected_) {
    discard();
    return fault("hash_mismatch", "the bytes hash to " + sha256 + ", not to the name they were sent under", expected_);
  }
  if (store_->files().fsync(fd_) != 0) {
    auto failed = io_fault(errno, "make a blob durable");
    discard();
    return failed;
  }
  auto stored = store_->publish(tmp_, sha256, bytes_);  // the lock holds on: nobody goes on with this file
  if (!stored) store_->files().unlink(tmp_);
  store_->files().close(std::exchange(fd_, -1));
  return stored;
}

}  // namespace kiln
