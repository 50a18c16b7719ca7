#include "server/blobs/file_layer.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

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

FileLayer& real_files() {
  static FileLayer files;  // without state: the system's own calls
  return files;
}

}  // namespace kiln
