#pragma once
// A file layer that fails or stops at a chosen call, and a power cut that forgets what was not synced.

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "server/blobs/file_layer.h"

namespace kiln::testing {

/// Thrown at the chosen call: the process is dead from here on.
struct Killed {};

/// Works on real files. Calls are numbered from 0.
class FaultyFiles : public FileLayer {
 public:
  int calls = 0;
  int kill_at = -1;  // this call is done, then nothing any more
  int fail_at = -1;  // this call fails with `error` and does nothing
  int error = EIO;
  bool interrupt = false;  // every first try of open, write and pread is interrupted
  bool short_writes = false;
  std::string failed_call;

  int open(const std::string& path, int flags, unsigned mode) override {
    return step<int>("open", true, [&] {
      const bool created = (flags & O_CREAT) != 0 && !std::filesystem::exists(path);
      const int fd = FileLayer::open(path, flags, mode);
      if (fd >= 0) paths_[fd] = path;
      if (fd >= 0 && created) unsynced_entries_.push_back({path, "", false});
      return fd;
    });
  }
  ssize_t write(int fd, const void* data, std::size_t size) override {
    return step<ssize_t>("write", true, [&] {
      const std::string& path = paths_[fd];
      std::error_code none;
      if (!unsynced_bytes_.contains(path)) unsynced_bytes_[path] = std::filesystem::file_size(path, none);
      return FileLayer::write(fd, data, short_writes && size > 1 ? size / 2 : size);
    });
  }
  ssize_t pread(int fd, void* data, std::size_t size, std::int64_t offset) override {
    return step<ssize_t>("pread", true, [&] { return FileLayer::pread(fd, data, size, offset); });
  }
  int fsync(int fd) override {
    return step<int>("fsync", false, [&] {
      const std::filesystem::path path = paths_[fd];
      unsynced_bytes_.erase(path);
      if (std::filesystem::is_directory(path)) {
        std::erase_if(unsynced_entries_,
                      [&](const Entry& entry) { return std::filesystem::path(entry.path).parent_path() == path; });
      }
      return 0;  // what a sync keeps is kept by cut_power(); the test machine's disk need not turn
    });
  }
  int close(int fd) override {
    if (dead_) return ::close(fd);      // the kernel does it for the dead
    if (calls == fail_at) ::close(fd);  // a close that fails has closed all the same (close(2))
    return step<int>("close", false, [&] { return FileLayer::close(fd); });
  }
  int rename(const std::string& from, const std::string& to) override {
    return step<int>("rename", false, [&] {
      const bool existed = std::filesystem::exists(to);
      const int done = FileLayer::rename(from, to);
      if (done == 0) {
        unsynced_bytes_.erase(to);
        if (auto moved = unsynced_bytes_.extract(from); !moved.empty()) unsynced_bytes_[to] = moved.mapped();
        unsynced_entries_.push_back({to, from, existed});
      }
      return done;
    });
  }
  int unlink(const std::string& path) override {
    return step<int>("unlink", false, [&] { return FileLayer::unlink(path); });
  }
  int mkdir(const std::string& path, unsigned mode) override {
    return step<int>("mkdir", false, [&] {
      const int done = FileLayer::mkdir(path, mode);
      if (done == 0) unsynced_entries_.push_back({path, "", false});
      return done;
    });
  }

  /// What a power cut leaves: names and bytes that were synced. Of unsynced bytes none is left.
  void cut_power() {
    for (auto entry = unsynced_entries_.rbegin(); entry != unsynced_entries_.rend(); ++entry) {
      if (!entry->from.empty() && !entry->replaced) FileLayer::rename(entry->path, entry->from);
      if (entry->from.empty()) std::filesystem::remove_all(entry->path);
    }
    for (const auto& [path, synced] : unsynced_bytes_) {
      if (std::filesystem::exists(path) && std::filesystem::file_size(path) > synced) {
        std::filesystem::resize_file(path, synced);
      }
    }
  }

 private:
  struct Entry {
    std::string path, from;  // a name that a folder has but may forget; `from`: its name before a rename
    bool replaced;           // the name stood for the same bytes before
  };

  template <class T>
  T step(const char* name, bool interruptible, const std::function<T()>& call) {
    if (dead_) return fail<T>(EIO);
    const int number = calls++;
    if (number == fail_at) {
      failed_call = name;
      return fail<T>(error);
    }
    if (interrupt && interruptible && (interrupted_ = !interrupted_)) return fail<T>(EINTR);
    const T result = call();
    if (number != kill_at) return result;
    dead_ = true;
    throw Killed();
  }
  template <class T>
  static T fail(int number) {
    errno = number;
    return -1;
  }

  bool dead_ = false, interrupted_ = false;
  std::map<int, std::string> paths_;
  std::map<std::string, std::uintmax_t> unsynced_bytes_;  // path, and how many of its bytes were synced
  std::vector<Entry> unsynced_entries_;
};

}  // namespace kiln::testing
