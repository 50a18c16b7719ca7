#pragma once
// What the loops of a bake made, as a file: written by the bake that gives ranges away, read by those that take them.
// Bytes  records one after the other, of native numbers: u64 loop, u64 hash of its name, u64 items, u64 first, u64
// last,
//        and items [first, last) as the loop passes them (ItemStream).

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/base/file_bytes.h"
#include "core/base/shared_loop.h"

namespace kiln {

/// A file that can only grow, or shrink to a length that it had. Fails by std::system_error.
class GrowingFile {
 public:
  explicit GrowingFile(const std::string& path);
  ~GrowingFile();
  GrowingFile(const GrowingFile&) = delete;
  GrowingFile& operator=(const GrowingFile&) = delete;
  void append(std::span<const std::byte>);
  void flush();  // what was appended is in the file
  void shrink(std::uint64_t bytes);
  std::uint64_t bytes() const { return bytes_ + waiting_.size(); }

 private:
  void write(std::span<const std::byte>);
  int fd_;
  std::uint64_t bytes_ = 0;
  std::vector<std::byte> waiting_;
};

/// Which items a record holds.
struct RecordRange {
  std::uint64_t loop = 0, first = 0, last = 0;
};

void write_record(GrowingFile&, const SharedLoop&, const RecordRange&);

/// Gives a record's items to the loop; returns the bytes after it. Throws ForeignLoop when it holds others.
std::span<const std::byte> read_record(std::span<const std::byte> bytes, const SharedLoop&, const RecordRange&);

std::span<const std::byte> bytes_of(const FileBytes&);

}  // namespace kiln
