#include "server/blobs/file_layer.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdio>

namespace kiln {

int FileLayer::open(const std::string& path, int flags, unsigned mode) {
  return ::open(path.c_str(), flags | O_CLOEXEC, mode);
}
ssize_t FileLayer::write(int fd, const void* data, std::size_t size) { return ::write(fd, data, size); }
ssize_t FileLayer::pread(int fd, void* data, std::size_t size, std::int64_t offset) {
  return ::pread(fd, data, size, offset);
}
int FileLayer::fsync(int fd) { return ::fsync(fd); }
int FileLayer::close(int fd) { return ::close(fd); }
int FileLayer::rename(const std::string& from, const std::string& to) { return ::rename(from.c_str(), to.c_str()); }
int FileLayer::unlink(const std::string& path) { return ::unlink(path.c_str()); }
int FileLayer::mkdir(const std::string& path, unsigned mode) { return ::mkdir(path.c_str(), mode); }

int TimedFiles::fsync(int fd) {
  const auto begin = std::chrono::steady_clock::now();
  const int done = FileLayer::fsync(fd);
  const int error = errno;
  syncs_.add(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  errno = error;
  return done;
}

FileLayer& real_files() {
  static FileLayer files;  // without state: the system's own calls
  return files;
}

}  // namespace kiln
