// One blob on its way out or in.

#include <utility>

#include "server/blobs/blob_io.h"
#include "server/blobs/blob_store.h"

namespace kiln {

BlobReader::BlobReader(BlobReader&& other) noexcept
    : files_(other.files_), fd_(std::exchange(other.fd_, -1)), size_(other.size_) {}

BlobReader& BlobReader::operator=(BlobReader&& other) noexcept {
  std::swap(files_, other.files_);
  std::swap(fd_, other.fd_);
  std::swap(size_, other.size_);
  return *this;
}

BlobReader::~BlobReader() {
  if (fd_ >= 0) files_->close(fd_);
}

Result<std::size_t> BlobReader::read(std::uint64_t offset, std::span<std::uint8_t> out) const {
  std::size_t filled = 0;
  while (filled < out.size()) {
    const auto at = static_cast<std::int64_t>(offset + filled);
    const ssize_t got =
        retry_interrupted([&] { return files_->pread(fd_, out.data() + filled, out.size() - filled, at); });
    if (got < 0) return io_fault(errno, "read a blob");
    if (got == 0) break;
    filled += static_cast<std::size_t>(got);
  }
  return filled;
}

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
    store_->files_->close(fd_);
    store_->release_name(expected_);
  }
}

void BlobWriter::discard() {
  store_->files_->close(std::exchange(fd_, -1));
  store_->files_->unlink(tmp_);
  if (!expected_.empty()) store_->release_name(expected_);
}

Result<void> BlobWriter::write(std::span<const std::uint8_t> bytes) {
  if (fd_ < 0) return fault("io_failed", "this upload failed before");
  std::size_t written = 0;
  while (written < bytes.size()) {
    const ssize_t put =
        retry_interrupted([&] { return store_->files_->write(fd_, bytes.data() + written, bytes.size() - written); });
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
  if (store_->files_->fsync(fd_) != 0) {
    auto failed = io_fault(errno, "make a blob durable");
    discard();
    return failed;
  }
  const int closed = store_->files_->close(std::exchange(fd_, -1));
  auto stored = closed == 0 ? store_->publish(tmp_, sha256, bytes_) : io_fault(errno, "close a blob");
  if (!stored) store_->files_->unlink(tmp_);
  if (!expected_.empty()) store_->release_name(expected_);
  return stored;
}

}  // namespace kiln
