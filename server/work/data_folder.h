#pragma once
// The data folder: one owner at a time, and how full its disk is.

#include <cstdint>
#include <filesystem>

#include "core/base/result.h"

namespace kiln {

/// Holds an flock on <data>/lock until the end, also that by kill -9.
class DataLock {
 public:
  /// Makes the folder when missing. Fails with data_in_use or io_failed.
  static Result<DataLock> take(const std::filesystem::path& data);
  DataLock(DataLock&&) noexcept;
  DataLock& operator=(DataLock&&) = delete;
  ~DataLock();

 private:
  explicit DataLock(int fd) : fd_(fd) {}
  int fd_;
};

struct DiskSpace {
  std::uint64_t free_bytes = 0;  // that this process may use
  double free_fraction = 1;      // of the whole
};
DiskSpace disk_space(const std::filesystem::path&);

}  // namespace kiln
