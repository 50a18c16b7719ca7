#include "core/base/file_bytes.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <utility>

namespace kiln {
namespace {

tl::unexpected<Fault> spill_fault(int error) {
  const bool full = error == ENOSPC || error == EDQUOT || error == EFBIG;
  return full ? fault("disk_full", "The disk is full: what does not fit into memory could not be put aside.")
              : fault("spill_failed", "A temporary file could not be made.");
}

/// A closed descriptor at the end of its scope.
struct Descriptor {
  int number;
  ~Descriptor() {
    if (number >= 0) ::close(number);
  }
};

}  // namespace

FileBytes::FileBytes(std::vector<std::uint8_t> bytes) {
  const auto held = std::make_shared<const std::vector<std::uint8_t>>(std::move(bytes));
  bytes_ = *held;
  owner_ = held;
}

Result<FileBytes> FileBytes::map(int descriptor, const std::string& name) {
  struct stat about {};
  if (::fstat(descriptor, &about) != 0 || !S_ISREG(about.st_mode))
    return fault("file_not_found", "There is no such file.", name);
  FileBytes out;
  const auto size = static_cast<std::size_t>(about.st_size);
  if (size == 0) return out;
  void* at = ::mmap(nullptr, size, PROT_READ, MAP_SHARED, descriptor, 0);
  if (at == MAP_FAILED) return fault("file_unreadable", "The file cannot be read.", name);
  out.owner_ = std::shared_ptr<const void>(at, [size](const void* p) { ::munmap(const_cast<void*>(p), size); });
  out.bytes_ = {static_cast<const std::uint8_t*>(at), size};
  return out;
}

Result<FileBytes> FileBytes::map(const std::string& path, const std::string& name) {
  const Descriptor file{::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
  if (file.number < 0 && errno == ENOENT) return fault("file_not_found", "There is no such file.", name);
  if (file.number < 0) return fault("file_unreadable", "The file cannot be read.", name);
  return map(file.number, name);
}

Result<SpillFile> SpillFile::create(const std::string& folder) {
  std::string path = folder + "/spill.XXXXXX";
  const int descriptor = ::mkostemp(path.data(), O_CLOEXEC);
  if (descriptor < 0) return spill_fault(errno);
  ::unlink(path.c_str());
  return SpillFile(descriptor);
}

SpillFile::~SpillFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}
SpillFile::SpillFile(SpillFile&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
SpillFile& SpillFile::operator=(SpillFile&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  return *this;
}

Result<void> SpillFile::append(std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t put = ::write(descriptor_, bytes.data(), bytes.size());
    if (put < 0 && errno == EINTR) continue;
    if (put < 0) return spill_fault(errno);
    bytes = bytes.subspan(static_cast<std::size_t>(put));
  }
  return {};
}

Result<FileBytes> SpillFile::bytes() const { return FileBytes::map(descriptor_, "temporary file"); }

}  // namespace kiln
