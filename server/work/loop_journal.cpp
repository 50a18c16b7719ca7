#include "server/work/loop_journal.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <string_view>
#include <system_error>
#include <utility>

namespace kiln {
namespace {

constexpr std::size_t kBuffer = 1 << 20;

std::uint64_t hash_of(std::string_view name) {
  std::uint64_t hash = 0xcbf29ce484222325ULL;  // FNV-1a
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  return hash;
}

[[noreturn]] void fail() { throw std::system_error(errno, std::generic_category(), "the journal of a bake"); }

std::array<std::uint64_t, 5> head_of(const SharedLoop& loop, const RecordRange& range) {
  return {range.loop, hash_of(loop.name), loop.items, range.first, range.last};
}

}  // namespace

GrowingFile::GrowingFile(const std::string& path)
    : fd_(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600)) {
  if (fd_ < 0) fail();
}

GrowingFile::~GrowingFile() { ::close(fd_); }

void GrowingFile::append(std::span<const std::byte> bytes) {
  if (waiting_.size() + bytes.size() > kBuffer) flush();
  if (bytes.size() > kBuffer) return write(bytes);
  waiting_.insert(waiting_.end(), bytes.begin(), bytes.end());
}

void GrowingFile::flush() {
  const std::vector<std::byte> now = std::exchange(waiting_, {});
  write(now);
}

void GrowingFile::write(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t put = ::pwrite(fd_, bytes.data(), bytes.size(), static_cast<off_t>(bytes_));
    if (put < 0 && errno == EINTR) continue;
    if (put < 0) fail();
    bytes_ += static_cast<std::uint64_t>(put);
    bytes = bytes.subspan(static_cast<std::size_t>(put));
  }
}

void GrowingFile::shrink(std::uint64_t bytes) {
  flush();
  if (::ftruncate(fd_, static_cast<off_t>(bytes)) != 0) fail();
  bytes_ = bytes;
}

void write_record(GrowingFile& file, const SharedLoop& loop, const RecordRange& range) {
  ItemStream stream([&](std::span<const std::byte> bytes) { file.append(bytes); });
  auto head = head_of(loop, range);
  stream.pass<std::uint64_t>(std::span(head));
  loop.pass(range.first, range.last, stream);
}

std::span<const std::byte> read_record(std::span<const std::byte> bytes, const SharedLoop& loop,
                                       const RecordRange& range) {
  ItemStream stream(bytes);
  auto head = head_of(loop, range);
  stream.pass<std::uint64_t>(std::span(head));
  if (head != head_of(loop, range)) throw ForeignLoop();
  loop.pass(range.first, range.last, stream);
  return stream.left();
}

std::span<const std::byte> bytes_of(const FileBytes& file) {
  return std::as_bytes(static_cast<std::span<const std::uint8_t>>(file));
}

}  // namespace kiln
