#pragma once
// The bytes of a file: held, or mapped from disk.

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.h"

namespace kiln {

/// Copies share the bytes, which never change. Mapped bytes are the system's memory, not this process's own: a file may
/// be larger than memory. A file must not be cut short while it is mapped.
class FileBytes {
 public:
  FileBytes() = default;
  FileBytes(std::vector<std::uint8_t> bytes);  // NOLINT(google-explicit-constructor): a vector of bytes is a file

  /// Fails with file_not_found (not a regular file) and file_unreadable; `name` is what places call it.
  static Result<FileBytes> map(const std::string& path, const std::string& name);
  /// Of an open file, which may be closed afterwards.
  static Result<FileBytes> map(int descriptor, const std::string& name);

  operator std::span<const std::uint8_t>() const { return bytes_; }  // NOLINT(google-explicit-constructor)
  std::size_t size() const { return bytes_.size(); }
  bool empty() const { return bytes_.empty(); }

 private:
  std::shared_ptr<const void> owner_;
  std::span<const std::uint8_t> bytes_;
};

/// A temporary file that no other process can name: written from begin to end, then mapped. Its space is given back
/// when it and its bytes are gone, also by a crash.
class SpillFile {
 public:
  /// Fails with spill_failed.
  static Result<SpillFile> create(const std::string& folder);
  ~SpillFile();
  SpillFile(SpillFile&&) noexcept;
  SpillFile& operator=(SpillFile&&) noexcept;

  /// Fails with disk_full and spill_failed.
  Result<void> append(std::span<const std::uint8_t>);
  /// All that was appended.
  Result<FileBytes> bytes() const;

 private:
  explicit SpillFile(int descriptor) : descriptor_(descriptor) {}
  int descriptor_ = -1;
};

}  // namespace kiln
