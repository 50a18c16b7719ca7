#include "server/blobs/file_blobs.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <chrono>
#include <set>
#include <utility>

#include "server/blobs/blob_io.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

Result<void> make_folder(FileLayer& files, const fs::path& folder) {
  if (files.mkdir(folder, 0700) == 0 || errno == EEXIST) return {};
  return io_fault(errno, "make a folder of its store");
}

std::string shelf_name(int shelf) {
  constexpr const char* kHex = "0123456789abcdef";
  return {kHex[shelf / 16], kHex[shelf % 16]};
}

/// Keeps its bytes readable even if the blob is removed meanwhile.
class FileSource final : public BlobReader::Source {
 public:
  FileSource(FileLayer& files, int fd) : files_(&files), fd_(fd) {}
  FileSource(const FileSource&) = delete;
  FileSource& operator=(const FileSource&) = delete;
  ~FileSource() override { files_->close(fd_); }

  Result<std::size_t> read(std::uint64_t offset, std::span<std::uint8_t> out) override {
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

 private:
  FileLayer* files_;
  int fd_;
};

class FileBlobs final : public BlobStore {
 public:
  FileBlobs(fs::path root, FileLayer& files) : BlobStore(std::move(root), files) {}

  Result<void> make_folders();
  Result<std::vector<StoredBlob>> adopt(std::span<const fs::path> results) override;
  Result<BlobReader> open_blob(const std::string& sha256) const override;
  Result<void> place(const std::string& sha256, const fs::path& target) const override;
  Result<void> remove(const std::string& sha256) override;
  Result<void> for_each(const std::function<void(const BlobEntry&)>&) const override;
  Result<std::string> owner(const std::string& claimant) override;
  Result<void> check() override;

 protected:
  Result<StoredBlob> publish(const fs::path& tmp, const std::string& sha256, std::uint64_t bytes) override;
  Result<void> settle(const std::string& sha256) override {
    return sync_folder(files(), path_of(sha256).parent_path());
  }

 private:
  fs::path path_of(const std::string& sha256) const { return folder() / "cas" / sha256.substr(0, 2) / sha256; }
  bool has_file(const std::string& sha256) const;
  Result<void> move_in(const fs::path& file, const StoredBlob&);
  Result<void> copy_in(const fs::path& file, const StoredBlob&);
  Result<void> sync_shelves(std::span<const StoredBlob>);
};

Result<void> FileBlobs::make_folders() {
  for (const char* part : {"", "cas", "tmp"}) {
    if (auto made = make_folder(files(), folder() / part); !made) return made;
  }
  // All 256 shelves now: a folder made later would have to be synced by everyone who finds it.
  for (int shelf = 0; shelf < 256; ++shelf) {
    if (auto made = make_folder(files(), folder() / "cas" / shelf_name(shelf)); !made) return made;
  }
  for (const fs::path& changed : {folder() / "cas", folder()}) {
    if (auto synced = sync_folder(files(), changed); !synced) return synced;
  }
  return {};
}

bool FileBlobs::has_file(const std::string& sha256) const {
  std::error_code none;
  return fs::is_regular_file(path_of(sha256), none);
}

Result<StoredBlob> FileBlobs::publish(const fs::path& tmp, const std::string& sha256, std::uint64_t bytes) {
  const StoredBlob blob{sha256, bytes, has_file(sha256)};
  if (files().rename(tmp, path_of(sha256)) != 0) return io_fault(errno, "name a blob");
  if (auto synced = sync_shelves({&blob, 1}); !synced) return tl::make_unexpected(synced.error());
  return blob;
}

Result<void> FileBlobs::move_in(const fs::path& file, const StoredBlob& blob) {
  if (files().rename(file, path_of(blob.sha256)) == 0) return {};
  if (errno != EXDEV) return io_fault(errno, "name a blob");
  if (auto copied = copy_in(file, blob); !copied) return copied;
  files().unlink(file);
  return {};
}

/// From another file system: workers bake on their own machine's disk, the store is a shared directory.
Result<void> FileBlobs::copy_in(const fs::path& file, const StoredBlob& blob) {
  auto writer = write();
  if (!writer) return tl::make_unexpected(writer.error());
  const int fd = retry_interrupted([&] { return files().open(file, O_RDONLY | O_NOFOLLOW); });
  if (fd < 0) return io_fault(errno, "open a result");
  Result<void> written;
  auto read = read_all(files(), fd, [&](std::span<const std::uint8_t> piece) {
    if (written) written = writer->write(piece);
  });
  files().close(fd);
  if (!read) return read;
  if (!written) return written;
  auto stored = writer->finish();
  if (!stored) return tl::make_unexpected(stored.error());
  if (stored->sha256 != blob.sha256) return fault("io_failed", "a result changed while it was stored");
  return {};
}

Result<void> FileBlobs::sync_shelves(std::span<const StoredBlob> blobs) {
  std::set<fs::path> shelves;
  for (const StoredBlob& blob : blobs) shelves.insert(path_of(blob.sha256).parent_path());
  for (const fs::path& shelf : shelves) {
    if (auto synced = sync_folder(files(), shelf); !synced) return synced;
  }
  return {};
}

Result<std::vector<StoredBlob>> FileBlobs::adopt(std::span<const fs::path> results) {
  // All bytes, then all names, then all shelves: a journal then commits once for the names and not once for each.
  std::vector<StoredBlob> blobs;
  for (const fs::path& file : results) {
    auto sealed = seal_file(files(), file);
    if (!sealed) return tl::make_unexpected(sealed.error());
    sealed->existed = has_file(sealed->sha256);
    blobs.push_back(std::move(*sealed));
  }
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (auto moved = move_in(results[i], blobs[i]); !moved) return tl::make_unexpected(moved.error());
  }
  if (auto synced = sync_shelves(blobs); !synced) return tl::make_unexpected(synced.error());
  return blobs;
}

Result<BlobReader> FileBlobs::open_blob(const std::string& sha256) const {
  if (!is_sha256(sha256)) return fault("not_found", "there is no such blob");
  const int fd = retry_interrupted([&] { return files().open(path_of(sha256), O_RDONLY); });
  if (fd < 0 && errno == ENOENT) return fault("not_found", "there is no such blob");
  if (fd < 0) return io_fault(errno, "open a blob");
  auto source = std::make_unique<FileSource>(files(), fd);
  struct stat status {};
  if (::fstat(fd, &status) != 0) return io_fault(errno, "examine a blob");
  return BlobReader(std::move(source), static_cast<std::uint64_t>(status.st_size));
}

Result<void> FileBlobs::place(const std::string& sha256, const fs::path& target) const {
  if (!is_sha256(sha256)) return fault("not_found", "there is no such blob");
  std::error_code error;
  fs::create_hard_link(path_of(sha256), target, error);
  // A file system without hard links, or another one than the store's.
  if (error && error != std::errc::no_such_file_or_directory) fs::copy_file(path_of(sha256), target, error);
  if (error == std::errc::no_such_file_or_directory) return fault("not_found", "there is no such blob");
  if (error) return io_fault(error.value(), "copy a blob");
  return {};
}

Result<void> FileBlobs::remove(const std::string& sha256) {
  if (!is_sha256(sha256) || files().unlink(path_of(sha256)) == 0 || errno == ENOENT) return {};
  return io_fault(errno, "remove a blob");
}

Result<void> FileBlobs::for_each(const std::function<void(const BlobEntry&)>& visit) const {
  std::error_code none;
  for (const auto& entry : fs::recursive_directory_iterator(folder() / "cas", none)) {
    const std::string name = entry.path().filename();
    if (!entry.is_regular_file(none) || !is_sha256(name)) continue;
    const std::chrono::duration<double> age = fs::file_time_type::clock::now() - entry.last_write_time(none);
    visit({name, entry.file_size(none), none ? 0 : age.count()});  // gone meanwhile: as if just made
  }
  return {};
}

Result<std::string> FileBlobs::owner(const std::string& claimant) {
  const fs::path file = folder() / "owner";
  const int fd = retry_interrupted([&] { return files().open(file, O_RDWR | O_CREAT | O_APPEND, 0600); });
  if (fd < 0) return io_fault(errno, "open the owner's name");
  retry_interrupted([&] { return ::flock(fd, LOCK_EX); });  // servers of one fleet may start at the same moment
  std::string owner;
  auto read = read_all(files(), fd, [&](std::span<const std::uint8_t> piece) {
    owner.append(reinterpret_cast<const char*>(piece.data()), piece.size());
  });
  bool written = true;
  if (read && owner.empty()) {
    written = files().write(fd, claimant.data(), claimant.size()) == static_cast<ssize_t>(claimant.size()) &&
              files().fsync(fd) == 0;
    owner = claimant;
  }
  const int error = errno;
  files().close(fd);
  if (!read) return tl::make_unexpected(read.error());
  if (!written) return io_fault(error, "write the owner's name");
  if (auto synced = sync_folder(files(), folder()); !synced) return tl::make_unexpected(synced.error());
  return owner;
}

Result<void> FileBlobs::check() {
  if (auto probe = write(); !probe) return tl::make_unexpected(probe.error());
  return {};
}

}  // namespace

Result<std::unique_ptr<BlobStore>> open_file_blobs(const fs::path& root, FileLayer& files) {
  auto blobs = std::make_unique<FileBlobs>(root, files);
  if (auto made = blobs->make_folders(); !made) return tl::make_unexpected(made.error());
  return blobs;
}

}  // namespace kiln
