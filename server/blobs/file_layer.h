#pragma once
// The system calls that durability rests on, so that tests can make each of them fail or be the last.

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <string>

#include "core/base/durations.h"

namespace kiln {

/// Same meaning, return value and errno as the system call of that name.
class FileLayer {
 public:
  virtual ~FileLayer() = default;
  virtual int open(const std::string& path, int flags, unsigned mode = 0);
  virtual ssize_t write(int fd, const void* data, std::size_t size);
  virtual ssize_t pread(int fd, void* data, std::size_t size, std::int64_t offset);
  virtual int fsync(int fd);
  virtual int close(int fd);
  virtual int rename(const std::string& from, const std::string& to);
  virtual int unlink(const std::string& path);
  virtual int mkdir(const std::string& path, unsigned mode);
};

/// The machine's own files, and how long their syncs take.
class TimedFiles final : public FileLayer {
 public:
  int fsync(int fd) override;
  const Durations& syncs() const { return syncs_; }

 private:
  Durations syncs_;
};

/// The machine's own files.
FileLayer& real_files();

}  // namespace kiln
