#include "server/work/data_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <system_error>
#include <utility>

namespace kiln {

Result<DataLock> DataLock::take(const std::filesystem::path& data) {
  std::error_code error;
  std::filesystem::create_directories(data, error);
  if (error) return fault("io_failed", "the data folder cannot be made: " + error.message());
  const int fd = ::open((data / "lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (fd < 0) return fault("io_failed", "the data folder cannot be written");
  DataLock lock(fd);
  if (::flock(fd, LOCK_EX | LOCK_NB) != 0) return fault("data_in_use", "another server uses this data folder");
  return lock;
}

DataLock::DataLock(DataLock&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}

DataLock::~DataLock() {
  if (fd_ >= 0) ::close(fd_);
}

DiskSpace disk_space(const std::filesystem::path& path) {
  struct statvfs disk {};
  if (::statvfs(path.c_str(), &disk) != 0 || disk.f_blocks == 0) return {};
  const auto unit = static_cast<std::uint64_t>(disk.f_frsize);
  return {disk.f_bavail * unit, static_cast<double>(disk.f_bavail) / static_cast<double>(disk.f_blocks)};
}

}  // namespace kiln
