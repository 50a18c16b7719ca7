#include "server/blobs/partial_upload.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <charconv>
#include <utility>

#include "server/blobs/blob_io.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kCountEvery = 16u << 20;  // bytes that a power cut may cost a long piece
constexpr const char *kBytes = "", *kInfo = ".info", *kDone = ".done", *kNew = ".new.";

tl::unexpected<Fault> unknown() { return fault("not_found", "there is no such upload, or it is over"); }

bool is_id(const std::string& text) {
  return text.size() == 32 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

/// Closes a file on every way out, and with it its lock.
class HeldFile {
 public:
  HeldFile(FileLayer& files, int fd) : files_(files), fd_(fd) {}
  HeldFile(const HeldFile&) = delete;
  HeldFile& operator=(const HeldFile&) = delete;
  ~HeldFile() { close(); }
  void close() {
    if (fd_ >= 0) files_.close(std::exchange(fd_, -1));
  }
  int release() { return std::exchange(fd_, -1); }

 private:
  FileLayer& files_;
  int fd_;
};

/// One "name value" a line.
std::string text_of(const PartialUpload& upload) {
  return "tenant " + upload.tenant + "\nlength " + std::to_string(upload.length) + "\noffset " +
         std::to_string(upload.offset) + "\nexpected " + upload.expected + "\nsha256 " + upload.sha256 + "\nmetadata " +
         upload.metadata + "\n";
}

/// The value of the next line, which must have this name.
bool take_line(std::string_view& text, std::string_view name, std::string& value) {
  const std::size_t end = text.find('\n');
  if (end == std::string_view::npos || !text.starts_with(name) || text.substr(name.size(), 1) != " ") return false;
  value = text.substr(name.size() + 1, end - name.size() - 1);
  text.remove_prefix(end + 1);
  return true;
}

bool take_number(std::string_view& text, std::string_view name, std::uint64_t& number) {
  std::string value;
  if (!take_line(text, name, value)) return false;
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
  return error == std::errc() && end == value.data() + value.size();
}

bool read_text(std::string_view text, PartialUpload& upload) {
  return take_line(text, "tenant", upload.tenant) && take_number(text, "length", upload.length) &&
         take_number(text, "offset", upload.offset) && take_line(text, "expected", upload.expected) &&
         take_line(text, "sha256", upload.sha256) && take_line(text, "metadata", upload.metadata) && text.empty();
}

/// All of `bytes`, or the errno of the call that failed.
int write_all(FileLayer& files, int fd, std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t put = retry_interrupted([&] { return files.write(fd, bytes.data(), bytes.size()); });
    if (put < 0) return errno;
    bytes = bytes.subspan(static_cast<std::size_t>(put));
  }
  return 0;
}

}  // namespace

PieceWriter::PieceWriter(PartialUploads& uploads, PartialUpload record, int fd)
    : uploads_(&uploads), record_(std::move(record)), fd_(fd), written_(record_.offset) {}

PieceWriter::PieceWriter(PieceWriter&& other) noexcept
    : uploads_(other.uploads_),
      record_(std::move(other.record_)),
      fd_(std::exchange(other.fd_, -1)),
      written_(other.written_),
      together_(other.together_) {}

PieceWriter::~PieceWriter() {
  if (fd_ >= 0 && !together_ && written_ > record_.offset) static_cast<void>(count());
  close();
}

void PieceWriter::close() {
  if (fd_ >= 0) uploads_->blobs_->files().close(std::exchange(fd_, -1));  // and with it the lock
}

Result<void> PieceWriter::write(std::span<const std::uint8_t> bytes) {
  if (fd_ < 0) return fault("io_failed", "this upload failed before");
  if (bytes.size() > record_.length - written_) {
    return fault("too_large", "the upload was announced with " + std::to_string(record_.length) + " bytes");
  }
  if (const int error = write_all(uploads_->blobs_->files(), fd_, bytes); error != 0) {
    close();  // what was counted before stays
    return io_fault(error, "write an upload");
  }
  written_ += bytes.size();
  if (together_ || written_ - record_.offset < kCountEvery) return {};
  return count();
}

Result<void> PieceWriter::count() {
  if (uploads_->blobs_->files().fsync(fd_) != 0) {
    auto failed = io_fault(errno, "make an upload durable");
    uploads_->forget(record_.id);
    close();
    return failed;
  }
  record_.offset = written_;
  return uploads_->write_record(record_);
}

Result<PartialUpload> PieceWriter::keep() {
  if (fd_ < 0) return fault("io_failed", "this upload failed before");
  if (written_ > record_.offset) {
    if (auto counted = count(); !counted) {
      close();
      return tl::make_unexpected(counted.error());
    }
  }
  close();
  return record_;
}

fs::path PartialUploads::file(const std::string& id, const char* suffix) const {
  return blobs_->folder() / "tmp" / ("up." + id + suffix);
}

/// The file of bytes, locked; a negative descriptor when there is none.
Result<int> PartialUploads::open_locked(const std::string& id, int flags) const {
  FileLayer& files = blobs_->files();
  const fs::path name = file(id, kBytes);
  const int fd = retry_interrupted([&] { return files.open(name, O_RDWR | O_APPEND | O_NOFOLLOW | flags, 0600); });
  if (fd < 0 && errno == ENOENT) return -1;
  if (fd < 0) return io_fault(errno, "open an upload");
  HeldFile held(files, fd);
  if (lock_file(fd, name)) return held.release();
  return fault("upload_busy", "somebody writes this upload already");
}

Result<PartialUpload> PartialUploads::read_record(const fs::path& name) const {
  FileLayer& files = blobs_->files();
  const int fd = retry_interrupted([&] { return files.open(name, O_RDONLY | O_NOFOLLOW); });
  if (fd < 0) return errno == ENOENT ? unknown() : io_fault(errno, "read the record of an upload");
  HeldFile held(files, fd);
  std::string text;
  struct stat status {};
  const bool dated = ::fstat(fd, &status) == 0;
  auto read =
      read_all(files, fd, [&](std::span<const std::uint8_t> piece) { text.append(piece.begin(), piece.end()); });
  held.close();
  if (!read) return tl::make_unexpected(read.error());
  PartialUpload upload;
  if (!dated || !read_text(text, upload)) return unknown();
  upload.expires_s = status.st_mtime + kKept.count();
  return upload;
}

/// Beside the old one, and then in its place. Two may do so at once: what they write of a whole upload is the same.
Result<void> PartialUploads::write_record(const PartialUpload& upload) {
  FileLayer& files = blobs_->files();
  const fs::path fresh = file(upload.id, (kNew + unique_name()).c_str()),
                 name = file(upload.id, upload.done ? kDone : kInfo);
  const int fd = retry_interrupted([&] { return files.open(fresh, O_WRONLY | O_CREAT | O_EXCL, 0600); });
  if (fd < 0) return io_fault(errno, "write the record of an upload");
  HeldFile held(files, fd);
  const std::string text = text_of(upload);
  int error = write_all(files, fd, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  if (error == 0 && files.fsync(fd) != 0) error = errno;
  held.close();
  if (error == 0 && files.rename(fresh, name) != 0) error = errno;
  if (error != 0) {
    files.unlink(fresh);
    return io_fault(error, "write the record of an upload");
  }
  return sync_folder(files, blobs_->folder() / "tmp");
}

void PartialUploads::forget(const std::string& id) {
  for (const char* suffix : {kInfo, kDone, kBytes}) blobs_->files().unlink(file(id, suffix));
}

/// Waits for its turn. The file may have been swept away by the time that comes: then there is another one.
Result<int> PartialUploads::lock_begin() const {
  FileLayer& files = blobs_->files();
  const fs::path name = blobs_->folder() / "tmp" / "up.begin";
  while (true) {
    const int fd = retry_interrupted([&] { return files.open(name, O_RDWR | O_CREAT | O_NOFOLLOW, 0600); });
    if (fd < 0) return io_fault(errno, "begin an upload");
    HeldFile held(files, fd);
    if (retry_interrupted([&] { return ::flock(fd, LOCK_EX); }) != 0) return io_fault(errno, "begin an upload");
    if (lock_file(fd, name)) return held.release();
  }
}

Result<PartialUpload> PartialUploads::begin(const PartialUpload& wanted, int most) {
  if (auto known = find(wanted.id, wanted.tenant); known || known.error().code != "not_found") return known;
  if (most <= 0) return make(wanted);
  KILN_TRY(turn, lock_begin());
  const HeldFile held(blobs_->files(), turn);
  if (unfinished(wanted.tenant) < most) return make(wanted);
  return fault("quota",
               "there may be " + std::to_string(most) + " unfinished uploads at a time: complete or delete some");
}

Result<PartialUpload> PartialUploads::make(const PartialUpload& wanted) {
  KILN_TRY(fd, open_locked(wanted.id, O_CREAT));
  HeldFile held(blobs_->files(), fd);
  auto made = find(wanted.id, wanted.tenant);  // by somebody who had the lock before
  if (!made && ::ftruncate(fd, 0) != 0) {
    made = io_fault(errno, "begin an upload");
  } else if (!made) {
    PartialUpload upload = wanted;
    upload.offset = 0;
    const auto written = write_record(upload);
    made = written ? find(wanted.id, wanted.tenant) : tl::make_unexpected(written.error());
  }
  held.close();
  return made;
}

Result<PartialUpload> PartialUploads::find(const std::string& id, const std::string& tenant) const {
  if (!is_id(id)) return unknown();
  Result<PartialUpload> upload = unknown();
  bool done = false;
  for (const char* suffix : {kDone, kInfo, kDone}) {  // again: it may become a blob between the looks
    upload = read_record(file(id, suffix));
    done = suffix == kDone;
    if (upload || upload.error().code != "not_found") break;
  }
  if (!upload) return upload;
  if (upload->tenant != tenant) return unknown();
  // Whoever named this record may have died before its sync, and a client that is told its offset forgets the bytes.
  if (auto synced = sync_folder(blobs_->files(), blobs_->folder() / "tmp"); !synced)
    return tl::make_unexpected(synced.error());
  upload->id = id;
  upload->done = done;
  return upload;
}

Result<PieceWriter> PartialUploads::append(const PartialUpload& wanted, std::uint64_t offset) {
  KILN_TRY(fd, open_locked(wanted.id, 0));
  if (fd < 0) return unknown();
  HeldFile held(blobs_->files(), fd);
  KILN_TRY(record, find(wanted.id, wanted.tenant));  // as it is now that nobody else writes
  struct stat status {};
  if (::fstat(fd, &status) != 0 || static_cast<std::uint64_t>(status.st_size) < record.offset) return unknown();
  PieceWriter writer(*this, record, held.release());
  if (offset != record.offset) {
    return fault("offset_mismatch", "the upload goes on at byte " + std::to_string(record.offset), wanted.id);
  }
  if (::ftruncate(fd, static_cast<off_t>(record.offset)) != 0) return io_fault(errno, "go on with an upload");
  return writer;
}

Result<StoredBlob> PartialUploads::store(const PartialUpload& whole) {
  KILN_TRY(fd, open_locked(whole.id, 0));
  if (fd < 0) {  // it went into the store, and then the server died or somebody else is about to say so
    KILN_TRY(now, find(whole.id, whole.tenant));
    if (now.sha256.empty() || !blobs_->exists(now.sha256)) return unknown();
    if (auto settled = blobs_->settle(now.sha256); !settled) return tl::make_unexpected(settled.error());
    return StoredBlob{now.sha256, now.length, true};
  }
  HeldFile held(blobs_->files(), fd);
  const fs::path name = file(whole.id, kBytes);
  auto stored = seal_file(blobs_->files(), name);
  if (stored && stored->bytes != whole.length) stored = unknown();
  if (stored && !whole.expected.empty() && stored->sha256 != whole.expected) {
    forget(whole.id);
    stored =
        fault("hash_mismatch", "the bytes hash to " + stored->sha256 + ", not to what was announced", whole.expected);
  }
  if (stored) {
    PartialUpload sealed = whole;
    sealed.sha256 = stored->sha256;
    const auto noted = write_record(sealed);
    stored = noted ? blobs_->publish(name, sealed.sha256, sealed.length) : tl::make_unexpected(noted.error());
  }
  held.close();
  return stored;
}

Result<void> PartialUploads::finish(const PartialUpload& whole, const std::string& sha256) {
  PartialUpload done = whole;
  done.sha256 = sha256;
  done.done = true;
  auto written = write_record(done);
  if (written) blobs_->files().unlink(file(whole.id, kInfo));
  return written;
}

Result<void> PartialUploads::remove(const PartialUpload& upload) {
  KILN_TRY(fd, open_locked(upload.id, 0));
  const HeldFile held(blobs_->files(), fd);
  forget(upload.id);
  return {};
}

int PartialUploads::unfinished(const std::string& tenant) const {
  std::error_code none;
  int count = 0;
  for (const auto& entry : fs::directory_iterator(blobs_->folder() / "tmp", none)) {
    const fs::path& name = entry.path();
    if (name.extension() != kInfo || !name.filename().string().starts_with("up.")) continue;
    const auto upload = read_record(name);
    if (upload && upload->tenant == tenant) ++count;
  }
  return count;
}

}  // namespace kiln
