#include "server/blobs/blob_store.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <mutex>
#include <set>
#include <string_view>
#include <utility>

#include "server/blobs/blob_io.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPartial = "part.";  // tmp/part.<sha256>: a named upload that may be resumed

bool is_partial(const fs::directory_entry& entry) { return entry.path().filename().string().starts_with(kPartial); }

std::string random_name() {
  static std::atomic<std::uint64_t> count{0};
  const auto now = std::chrono::steady_clock::now().time_since_epoch().count();
  return std::to_string(::getpid()) + "." + std::to_string(now) + "." + std::to_string(count++);
}

Result<void> make_folder(FileLayer& files, const fs::path& folder) {
  if (files.mkdir(folder, 0700) == 0 || errno == EEXIST) return {};
  return io_fault(errno, "make a folder of its store");
}

std::string shelf_name(int shelf) {
  constexpr const char* kHex = "0123456789abcdef";
  return {kHex[shelf / 16], kHex[shelf % 16]};
}

}  // namespace

bool is_sha256(const std::string& text) {
  return text.size() == 64 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

struct BlobStore::State {
  std::mutex mutex;
  std::set<std::string> uploading;  // names with a writer
};

BlobStore::BlobStore(fs::path root, FileLayer& files)
    : root_(std::move(root)), files_(&files), state_(std::make_unique<State>()) {}
BlobStore::~BlobStore() = default;

Result<std::unique_ptr<BlobStore>> BlobStore::open(const fs::path& root, FileLayer& files) {
  for (const char* folder : {"", "cas", "tmp"}) {
    if (auto made = make_folder(files, root / folder); !made) return tl::make_unexpected(made.error());
  }
  // All 256 shelves now: a folder made later would have to be synced by everyone who finds it.
  for (int shelf = 0; shelf < 256; ++shelf) {
    if (auto made = make_folder(files, root / "cas" / shelf_name(shelf)); !made) {
      return tl::make_unexpected(made.error());
    }
  }
  for (const fs::path& folder : {root / "cas", root}) {
    if (auto synced = sync_folder(files, folder); !synced) return tl::make_unexpected(synced.error());
  }
  return std::unique_ptr<BlobStore>(new BlobStore(root, files));
}

fs::path BlobStore::path_of(const std::string& sha256) const { return root_ / "cas" / sha256.substr(0, 2) / sha256; }

Result<BlobWriter> BlobStore::write() {
  fs::path tmp = root_ / "tmp" / ("new." + random_name());
  const int fd = retry_interrupted([&] { return files_->open(tmp, O_WRONLY | O_CREAT | O_EXCL, 0600); });
  if (fd < 0) return io_fault(errno, "begin a blob");
  return BlobWriter(*this, std::move(tmp), fd, "");
}

std::uint64_t BlobStore::partial_bytes(const std::string& sha256) const {
  std::error_code none;
  const auto size = is_sha256(sha256) ? fs::file_size(root_ / "tmp" / (std::string(kPartial) + sha256), none) : 0;
  return none ? 0 : size;
}

Result<BlobWriter> BlobStore::write_named(const std::string& sha256, std::uint64_t offset) {
  if (!is_sha256(sha256))
    return fault("hash_mismatch", "the name of an asset is its SHA-256 as 64 lower-case hex digits");
  {
    const std::lock_guard lock(state_->mutex);
    if (!state_->uploading.insert(sha256).second)
      return fault("upload_busy", "another upload of this asset is running");
  }
  fs::path tmp = root_ / "tmp" / (std::string(kPartial) + sha256);
  if (offset != 0 && offset != partial_bytes(sha256)) {
    release_name(sha256);
    return fault("offset_mismatch", "the upload goes on at byte " + std::to_string(partial_bytes(sha256)), sha256);
  }
  if (offset == 0) files_->unlink(tmp);
  const int fd = files_->open(tmp, offset == 0 ? O_RDWR | O_CREAT | O_EXCL : O_RDWR | O_APPEND, 0600);
  if (fd < 0) {
    auto failed = io_fault(errno, "begin a blob");
    release_name(sha256);
    return failed;
  }
  BlobWriter writer(*this, std::move(tmp), fd, sha256);
  if (offset != 0) {
    auto hashed = read_all(*files_, fd, [&](std::span<const std::uint8_t> bytes) { writer.hash_.update(bytes); });
    if (!hashed) return tl::make_unexpected(hashed.error());
    writer.bytes_ = offset;
  }
  return writer;
}

void BlobStore::release_name(const std::string& sha256) {
  const std::lock_guard lock(state_->mutex);
  state_->uploading.erase(sha256);
}

Result<StoredBlob> BlobStore::publish(const fs::path& tmp, const std::string& sha256, std::uint64_t bytes) {
  const StoredBlob blob{sha256, bytes, exists(sha256)};
  if (auto named = name(tmp, blob); !named) return tl::make_unexpected(named.error());
  if (auto synced = sync_shelves({&blob, 1}); !synced) return tl::make_unexpected(synced.error());
  return blob;
}

Result<void> BlobStore::name(const fs::path& tmp, const StoredBlob& blob) {
  if (files_->rename(tmp, path_of(blob.sha256)) != 0) return io_fault(errno, "name a blob");
  return {};
}

Result<void> BlobStore::sync_shelves(std::span<const StoredBlob> blobs) {
  std::set<fs::path> shelves;
  for (const StoredBlob& blob : blobs) shelves.insert(path_of(blob.sha256).parent_path());
  for (const fs::path& shelf : shelves) {
    if (auto synced = sync_folder(*files_, shelf); !synced) return synced;
  }
  return {};
}

Result<StoredBlob> BlobStore::seal(const fs::path& file) const {
  const int fd = retry_interrupted([&] { return files_->open(file, O_RDONLY | O_NOFOLLOW | O_NONBLOCK); });
  if (fd < 0 && (errno == ENOENT || errno == ELOOP)) return fault("not_found", "there is no such result");
  if (fd < 0) return io_fault(errno, "open a result");
  struct stat status {};
  const bool regular = ::fstat(fd, &status) == 0 && S_ISREG(status.st_mode);
  Sha256 hash;
  std::uint64_t bytes = 0;
  Result<void> done = regular ? read_all(*files_, fd,
                                         [&](std::span<const std::uint8_t> piece) {
                                           hash.update(piece);
                                           bytes += piece.size();
                                         })
                              : Result<void>(fault("not_found", "there is no such result: not a regular file"));
  if (done && files_->fsync(fd) != 0) done = io_fault(errno, "make a result durable");
  files_->close(fd);
  if (!done) return tl::make_unexpected(done.error());
  const std::string sha256 = hash.hex();
  return StoredBlob{sha256, bytes, exists(sha256)};
}

Result<std::vector<StoredBlob>> BlobStore::adopt(std::span<const fs::path> files) {
  // All bytes, then all names, then all shelves: a journal then commits once for the names and not once for each.
  std::vector<StoredBlob> blobs;
  for (const fs::path& file : files) {
    auto sealed = seal(file);
    if (!sealed) return tl::make_unexpected(sealed.error());
    blobs.push_back(std::move(*sealed));
  }
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (auto named = name(files[i], blobs[i]); !named) return tl::make_unexpected(named.error());
  }
  if (auto synced = sync_shelves(blobs); !synced) return tl::make_unexpected(synced.error());
  return blobs;
}

Result<BlobReader> BlobStore::open_blob(const std::string& sha256) const {
  if (!is_sha256(sha256)) return fault("not_found", "there is no such blob");
  const int fd = retry_interrupted([&] { return files_->open(path_of(sha256), O_RDONLY); });
  if (fd < 0 && errno == ENOENT) return fault("not_found", "there is no such blob");
  if (fd < 0) return io_fault(errno, "open a blob");
  BlobReader reader(*files_, fd, 0);
  struct stat status {};
  if (::fstat(fd, &status) != 0) return io_fault(errno, "examine a blob");
  return BlobReader(*files_, std::exchange(reader.fd_, -1), static_cast<std::uint64_t>(status.st_size));
}

bool BlobStore::exists(const std::string& sha256) const {
  std::error_code none;
  return is_sha256(sha256) && fs::is_regular_file(path_of(sha256), none);
}

Result<void> BlobStore::remove(const std::string& sha256) {
  if (!is_sha256(sha256) || files_->unlink(path_of(sha256)) == 0 || errno == ENOENT) return {};
  return io_fault(errno, "remove a blob");
}

void BlobStore::for_each(const std::function<void(const std::string&, std::uint64_t)>& visit) const {
  std::error_code none;
  for (const auto& entry : fs::recursive_directory_iterator(root_ / "cas", none)) {
    const std::string name = entry.path().filename();
    if (entry.is_regular_file(none) && is_sha256(name)) visit(name, entry.file_size(none));
  }
}

int BlobStore::remove_dead_writers() {
  return remove_tmp([](const fs::directory_entry& entry) { return !is_partial(entry); });
}

int BlobStore::expire_partials(double age_s) {
  const std::lock_guard lock(state_->mutex);
  return remove_tmp([&](const fs::directory_entry& entry) {
    std::error_code none;
    const std::chrono::duration<double> age = fs::file_time_type::clock::now() - entry.last_write_time(none);
    const std::string name = entry.path().filename();
    return is_partial(entry) && age.count() >= age_s && !state_->uploading.contains(name.substr(kPartial.size()));
  });
}

int BlobStore::remove_tmp(const std::function<bool(const fs::directory_entry&)>& chosen) {
  std::error_code none;
  int removed = 0;
  for (const auto& entry : fs::directory_iterator(root_ / "tmp", none)) {
    if (chosen(entry) && files_->unlink(entry.path()) == 0) ++removed;
  }
  return removed;
}

}  // namespace kiln
