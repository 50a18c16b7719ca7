#include "server/blobs/blob_io.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <vector>

namespace kiln {
namespace {

constexpr std::size_t kPiece = 256 * 1024;

}  // namespace

tl::unexpected<Fault> io_fault(int error, const char* doing) {
  if (error == ENOSPC || error == EDQUOT) return fault("disk_full", "the disk of the server is full");
  return fault("io_failed", std::string("the server could not ") + doing + " (errno " + std::to_string(error) + ")");
}

bool lock_file(int fd, const std::filesystem::path& name) {
  if (::flock(fd, LOCK_EX | LOCK_NB) != 0) return false;
  struct stat opened {
  }, named{};
  return ::fstat(fd, &opened) == 0 && ::stat(name.c_str(), &named) == 0 && opened.st_ino == named.st_ino;
}

std::string unique_name() {
  static std::atomic<std::uint64_t> count{0};
  static const std::string machine = [] {
    std::string name(64, '\0');
    if (::gethostname(name.data(), name.size()) != 0) name.clear();
    return name.substr(0, name.find('\0'));
  }();
  const auto now = std::chrono::system_clock::now().time_since_epoch().count();
  return machine + "." + std::to_string(::getpid()) + "." + std::to_string(now) + "." + std::to_string(count++);
}

Result<void> sync_folder(FileLayer& files, const std::filesystem::path& folder) {
  const int fd = retry_interrupted([&] { return files.open(folder, O_RDONLY | O_DIRECTORY); });
  if (fd < 0) return io_fault(errno, "open a folder of its store");
  const int synced = files.fsync(fd);
  const int error = errno;
  files.close(fd);
  if (synced != 0) return io_fault(error, "sync a folder of its store");
  return {};
}

Result<void> read_all(FileLayer& files, int fd, const std::function<void(std::span<const std::uint8_t>)>& take) {
  std::vector<std::uint8_t> piece(kPiece);
  for (std::int64_t offset = 0;;) {
    const ssize_t got = retry_interrupted([&] { return files.pread(fd, piece.data(), piece.size(), offset); });
    if (got < 0) return io_fault(errno, "read a file of its store");
    if (got == 0) return {};
    take({piece.data(), static_cast<std::size_t>(got)});
    offset += got;
  }
}

Result<StoredBlob> seal_file(FileLayer& files, const std::filesystem::path& file) {
  const int fd = retry_interrupted([&] { return files.open(file, O_RDONLY | O_NOFOLLOW | O_NONBLOCK); });
  if (fd < 0 && (errno == ENOENT || errno == ELOOP)) return fault("not_found", "there is no such result");
  if (fd < 0) return io_fault(errno, "open a result");
  struct stat status {};
  const bool regular = ::fstat(fd, &status) == 0 && S_ISREG(status.st_mode);
  Sha256 hash;
  std::uint64_t bytes = 0;
  Result<void> done = regular ? read_all(files, fd,
                                         [&](std::span<const std::uint8_t> piece) {
                                           hash.update(piece);
                                           bytes += piece.size();
                                         })
                              : Result<void>(fault("not_found", "there is no such result: not a regular file"));
  if (done && files.fsync(fd) != 0) done = io_fault(errno, "make a result durable");
  files.close(fd);
  if (!done) return tl::make_unexpected(done.error());
  return StoredBlob{hash.hex(), bytes, false};
}

}  // namespace kiln
