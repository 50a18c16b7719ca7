// The spool: files on their way in, each locked by its writer.

#include "server/blobs/blob_store.h"

#include <fcntl.h>
#include <unistd.h>

#include <chrono>
#include <string_view>
#include <utility>

#include "core/base/expects.h"
#include "server/blobs/blob_io.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPartial = "part.";  // tmp/part.<sha256>.<tenant>: a named upload that may be resumed

/// A named upload, or one that comes in pieces (partial_upload.h).
bool is_partial(const fs::path& file) {
  const std::string name = file.filename();
  return name.starts_with(kPartial) || name.starts_with("up.");
}

}  // namespace

bool is_sha256(const std::string& text) {
  return text.size() == 64 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

fs::path BlobStore::part_of(const std::string& sha256, const std::string& tenant) const {
  EXPECTS(tenant.find('/') == std::string::npos);
  return folder_ / "tmp" / (std::string(kPartial) + sha256 + (tenant.empty() ? "" : "." + tenant));
}

Result<BlobWriter> BlobStore::write() {
  fs::path tmp = folder_ / "tmp" / ("new." + unique_name());
  const int fd = retry_interrupted([&] { return files_->open(tmp, O_WRONLY | O_CREAT | O_EXCL, 0600); });
  if (fd < 0) return io_fault(errno, "begin a blob");
  BlobWriter writer(*this, tmp, fd, "");
  if (!lock_file(fd, tmp)) return fault("io_failed", "the server could not begin a blob (lock)");
  return writer;
}

std::uint64_t BlobStore::partial_bytes(const std::string& sha256, const std::string& tenant) const {
  std::error_code none;
  const auto size = is_sha256(sha256) ? fs::file_size(part_of(sha256, tenant), none) : 0;
  return none ? 0 : size;
}

Result<BlobWriter> BlobStore::write_named(const std::string& sha256, std::uint64_t offset, const std::string& tenant) {
  if (!is_sha256(sha256))
    return fault("hash_mismatch", "the name of an asset is its SHA-256 as 64 lower-case hex digits");
  const fs::path tmp = part_of(sha256, tenant);
  const int fd = retry_interrupted([&] { return files_->open(tmp, O_RDWR | O_CREAT | O_APPEND, 0600); });
  if (fd < 0) return io_fault(errno, "begin a blob");
  BlobWriter writer(*this, tmp, fd, sha256);  // closes the file on every way out
  if (!lock_file(fd, tmp)) return fault("upload_busy", "another upload of this asset is running");
  const std::uint64_t kept = partial_bytes(sha256, tenant);
  if (offset != 0 && offset != kept) {
    return fault("offset_mismatch", "the upload goes on at byte " + std::to_string(kept), sha256);
  }
  if (offset == 0 && ::ftruncate(fd, 0) != 0) return io_fault(errno, "begin a blob");
  if (offset != 0) {
    auto hashed = read_all(*files_, fd, [&](std::span<const std::uint8_t> bytes) { writer.hash_.update(bytes); });
    if (!hashed) return tl::make_unexpected(hashed.error());
    writer.bytes_ = offset;
  }
  return writer;
}

int BlobStore::remove_dead_writers() {
  return remove_unlocked([](const fs::directory_entry& entry) { return !is_partial(entry.path()); });
}

int BlobStore::expire_partials(double age_s) {
  return remove_unlocked([&](const fs::directory_entry& entry) {
    std::error_code none;
    const std::chrono::duration<double> age = fs::file_time_type::clock::now() - entry.last_write_time(none);
    return is_partial(entry.path()) && age.count() >= age_s;
  });
}

int BlobStore::remove_unlocked(const std::function<bool(const fs::directory_entry&)>& chosen) {
  std::error_code none;
  int removed = 0;
  for (const auto& entry : fs::directory_iterator(folder_ / "tmp", none)) {
    if (!chosen(entry)) continue;
    const int fd = files_->open(entry.path(), O_RDWR);
    if (fd < 0) continue;
    if (lock_file(fd, entry.path()) && files_->unlink(entry.path()) == 0) ++removed;
    files_->close(fd);
  }
  return removed;
}

}  // namespace kiln
