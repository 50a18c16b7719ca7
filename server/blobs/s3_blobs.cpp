#include "server/blobs/s3_blobs.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <ctime>
#include <mutex>

#include "server/blobs/blob_io.h"
#include "server/blobs/s3_client.h"
#include "server/blobs/s3_list.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kLargestObject = 5ULL << 30;

std::string key_of(const std::string& sha256) { return sha256.substr(0, 2) + "/" + sha256; }

tl::unexpected<Fault> wrong_bytes(const std::string& sha256) {
  return fault("blobs_unavailable", "the blob store sent other bytes than it was given", sha256);
}

/// Asks for the part that is read. Read from the beginning to the end, the bytes are verified: the last piece is
/// withheld when they are not the blob's.
class S3Source final : public BlobReader::Source {
 public:
  S3Source(S3Client& client, std::string sha256, std::uint64_t size)
      : client_(client), sha256_(std::move(sha256)), size_(size) {}

  Result<std::size_t> read(std::uint64_t offset, std::span<std::uint8_t> out) override {
    if (offset >= size_ || out.empty()) return std::size_t{0};
    const auto part = out.first(static_cast<std::size_t>(std::min<std::uint64_t>(out.size(), size_ - offset)));
    if (auto got = client_.get_range(key_of(sha256_), offset, part); !got) return tl::make_unexpected(got.error());
    const std::lock_guard lock(mutex_);
    if (offset == hashed_) {
      hash_.update(part);
      hashed_ += part.size();
      if (hashed_ == size_ && hash_.hex() != sha256_) return wrong_bytes(sha256_);
    }
    return part.size();
  }

 private:
  S3Client& client_;
  const std::string sha256_;
  const std::uint64_t size_;
  std::mutex mutex_;
  Sha256 hash_;
  std::uint64_t hashed_ = 0;
};

class S3Blobs final : public BlobStore {
 public:
  S3Blobs(const S3Options& options, const fs::path& spool, FileLayer& files)
      : BlobStore(spool, files), client_(std::make_unique<S3Client>(options)) {}

  Result<std::vector<StoredBlob>> adopt(std::span<const fs::path> results) override {
    std::vector<StoredBlob> blobs;
    for (const fs::path& file : results) {
      KILN_TRY(sealed, seal_file(files(), file));
      KILN_TRY(stored, publish(file, sealed.sha256, sealed.bytes));
      blobs.push_back(std::move(stored));
    }
    return blobs;
  }

  Result<BlobReader> open_blob(const std::string& sha256) const override {
    if (!is_sha256(sha256)) return fault("not_found", "there is no such blob");
    KILN_TRY(size, client_->size_of(key_of(sha256)));
    return BlobReader(std::make_unique<S3Source>(*client_, sha256, size), size);
  }

  Result<void> place(const std::string& sha256, const fs::path& target) const override;
  Result<void> remove(const std::string& sha256) override {
    return is_sha256(sha256) ? client_->remove(key_of(sha256)) : Result<void>();
  }
  Result<void> for_each(const std::function<void(const BlobEntry&)>&) const override;
  Result<std::string> owner(const std::string& claimant) override;
  Result<void> check() override {
    if (auto probe = write(); !probe) return tl::make_unexpected(probe.error());
    return client_->check();
  }

 protected:
  Result<StoredBlob> publish(const fs::path& tmp, const std::string& sha256, std::uint64_t bytes) override;
  Result<void> settle(const std::string&) override { return {}; }

 private:
  std::unique_ptr<S3Client> client_;
};

Result<StoredBlob> S3Blobs::publish(const fs::path& tmp, const std::string& sha256, std::uint64_t bytes) {
  if (bytes > kLargestObject) return fault("too_large", "the blob store takes at most 5 GiB in one piece");
  const auto there = client_->size_of(key_of(sha256));
  const StoredBlob blob{sha256, bytes, there && *there == bytes};
  if (!blob.existed) {
    const int fd = files().open(tmp, O_RDONLY | O_NOFOLLOW);
    if (fd < 0) return io_fault(errno, "open a file of its spool");
    auto put = client_->put(key_of(sha256), sha256, fd, bytes);
    files().close(fd);
    if (!put) return tl::make_unexpected(put.error());
  }
  files().unlink(tmp);
  return blob;
}

Result<void> S3Blobs::place(const std::string& sha256, const fs::path& target) const {
  if (!is_sha256(sha256)) return fault("not_found", "there is no such blob");
  const int fd = files().open(target, O_WRONLY | O_CREAT | O_EXCL, 0600);
  if (fd < 0) return io_fault(errno, "make an input of a worker");
  Sha256 hash;
  int error = 0;
  const auto begin = [&] {
    hash = Sha256();
    if (::ftruncate(fd, 0) != 0 || ::lseek(fd, 0, SEEK_SET) != 0) error = errno;
  };
  const auto take = [&](std::span<const std::uint8_t> piece) {
    hash.update(piece);
    while (!piece.empty() && error == 0) {
      const ssize_t put = retry_interrupted([&] { return files().write(fd, piece.data(), piece.size()); });
      if (put < 0) error = errno;
      if (put > 0) piece = piece.subspan(static_cast<std::size_t>(put));
    }
    return error == 0;
  };
  auto got = client_->get(key_of(sha256), begin, take);
  if (files().close(fd) != 0 && error == 0) error = errno;
  if (error != 0) {
    got = io_fault(error, "write an input of a worker");
  } else if (got && hash.hex() != sha256) {
    got = wrong_bytes(sha256);
  }
  if (!got) files().unlink(target);
  return got;
}

Result<std::string> S3Blobs::owner(const std::string& claimant) {
  constexpr const char* kKey = "owner";
  std::string owner;
  const auto got = client_->get(
      kKey, [&] { owner.clear(); },
      [&](std::span<const std::uint8_t> piece) {
        owner.append(reinterpret_cast<const char*>(piece.data()), piece.size());
        return owner.size() <= 64;
      });
  if (got) return owner;
  if (got.error().code != "not_found") return tl::make_unexpected(got.error());
  const int fd = ::memfd_create("owner", MFD_CLOEXEC);
  if (fd < 0 || ::write(fd, claimant.data(), claimant.size()) != static_cast<ssize_t>(claimant.size())) {
    if (fd >= 0) ::close(fd);
    return io_fault(errno, "write the owner's name");
  }
  const std::span bytes(reinterpret_cast<const std::uint8_t*>(claimant.data()), claimant.size());
  const auto put = client_->put(kKey, sha256_hex(bytes), fd, claimant.size());
  ::close(fd);
  if (!put) return tl::make_unexpected(put.error());
  return claimant;
}

Result<void> S3Blobs::for_each(const std::function<void(const BlobEntry&)>& visit) const {
  const std::int64_t now = ::time(nullptr);
  std::string token;
  do {
    KILN_TRY(text, client_->list(token));
    KILN_TRY(page, read_s3_list(text));
    for (const S3Object& object : page.objects) {
      const std::string name = object.key.substr(std::min<std::size_t>(object.key.size(), 3));
      if (!is_sha256(name) || object.key != key_of(name)) continue;  // somebody else's
      visit({name, object.bytes, static_cast<double>(now - object.modified_s)});
    }
    token = page.next_token;
  } while (!token.empty());
  return {};
}

}  // namespace

Result<std::unique_ptr<BlobStore>> open_s3_blobs(const S3Options& options, const fs::path& spool, FileLayer& files) {
  std::error_code error;
  fs::create_directories(spool / "tmp", error);
  if (error) return fault("io_failed", "the spool for uploads cannot be made");
  auto blobs = std::make_unique<S3Blobs>(options, spool, files);
  if (auto ready = blobs->check(); !ready) return tl::make_unexpected(ready.error());
  return blobs;
}

}  // namespace kiln
