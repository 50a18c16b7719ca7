#pragma once
// A file layer that fails or stops at a chosen call, and a power cut that forgets what was not synced. It outlives the
// process that it stops: what one life left unsynced, a power cut in the next one still forgets.

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/blobs/file_layer.h"

namespace kiln::testing {

/// Thrown at the chosen call: the process is dead from here on.
struct Killed {};

/// How a life ends, or what goes wrong in it.
struct Blow {
  const char* name;
  int error = 0;  // of the call that fails; 0: the process is killed after it
  bool power_cut = false;
};
/// EINTR strikes only calls that a signal interrupts (open, write, pread), and is no failure: they are made again.
inline constexpr Blow kBlows[] = {{"kill"}, {"power cut", 0, true}, {"EIO", EIO}, {"ENOSPC", ENOSPC}, {"EINTR", EINTR}};

/// Of all pairs of blows one in `otherwise` is tried; with KILN_SOAK in the environment every one.
inline int pair_stride(int otherwise) { return std::getenv("KILN_SOAK") != nullptr ? 1 : otherwise; }

/// Which of two blows found a call to strike: a life that ends before has no more of them.
struct Struck {
  bool first = true, second = true;
};
/// Tries blows at calls i and j of two lives, for all pairs, one in `stride` of the j. `act(first, i, second, j)`
/// returns Struck; both false ends it. Returns the number of pairs.
template <class Act>
int try_pairs(int stride, const Act& act) {
  int pairs = 0;
  for (const Blow& first : kBlows) {
    for (const Blow& second : kBlows) {
      Struck struck;
      for (int i = 0; struck.first; ++i) {
        struck.second = true;
        for (int j = i % stride; struck.second; j += stride, ++pairs) struck = act(first, i, second, j);
      }
    }
  }
  return pairs;
}

/// Works on real files. Calls are numbered from 0.
class FaultyFiles : public FileLayer {
 public:
  int calls = 0;
  int kill_at = -1;  // this call is done, then nothing any more
  int fail_at = -1;  // this call fails with `error` and does nothing; with EINTR only if it can be interrupted
  int error = EIO;
  bool interrupt = false;  // every first try of open, write and pread is interrupted
  bool short_writes = false;
  std::string failed_call;  // none when it was interrupted

  ~FaultyFiles() override { restart(); }
  /// The next process on the same files. The kernel closes what the dead one had open.
  void restart() {
    for (const auto& [fd, path] : paths_) ::close(fd);
    paths_.clear();
    dead_ = struck_ = false;
    kill_at = fail_at = -1;
    failed_call.clear();
  }
  /// `call` calls from now.
  void strike(const Blow& blow, int call) {
    error = blow.error;
    (blow.error == 0 ? kill_at : fail_at) = calls + call;
  }
  bool struck() const { return dead_ || struck_; }
  /// Somebody else wrote this file, and synced nothing.
  void written_by_another(const std::string& path) {
    unsynced_bytes_[path] = 0;
    unsynced_entries_.push_back({path, "", {}});
  }

  int open(const std::string& path, int flags, unsigned mode) override {
    return step<int>("open", true, [&] {
      const bool created = (flags & O_CREAT) != 0 && !std::filesystem::exists(path);
      const int fd = FileLayer::open(path, flags, mode);
      if (fd >= 0) paths_[fd] = path;
      if (fd >= 0 && created) unsynced_entries_.push_back({path, "", {}});
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
    paths_.erase(fd);
    if (dead_) return ::close(fd);      // the kernel does it for the dead
    if (calls == fail_at) ::close(fd);  // a close that fails has closed all the same (close(2))
    if (calls == kill_at) {             // destructors close, and may not throw: the next call does
      ++calls;
      dead_ = true;
      return FileLayer::close(fd);
    }
    return step<int>("close", false, [&] { return FileLayer::close(fd); });
  }
  int rename(const std::string& from, const std::string& to) override {
    return step<int>("rename", false, [&] {
      Entry entry{to, from, contents(to)};
      const int done = FileLayer::rename(from, to);
      if (done == 0) {
        unsynced_bytes_.erase(to);
        move_unsynced(from, to);
        unsynced_entries_.push_back(std::move(entry));
      }
      return done;
    });
  }
  int unlink(const std::string& path) override {
    return step<int>("unlink", false, [&] {
      Entry entry{path, path, contents(path)};
      const int done = FileLayer::unlink(path);
      if (done == 0) unsynced_entries_.push_back(std::move(entry));
      return done;
    });
  }
  int mkdir(const std::string& path, unsigned mode) override {
    return step<int>("mkdir", false, [&] {
      if (!folders_.insert(path).second) return fail<int>(EEXIST);  // known, and quicker than to ask
      const int done = FileLayer::mkdir(path, mode);
      if (done == 0) unsynced_entries_.push_back({path, "", {}});
      return done;
    });
  }

  /// What a power cut leaves: names and bytes that were synced. Of unsynced bytes none is left; names that were given,
  /// replaced or taken away since the last sync of their folder are as they were before.
  void cut_power() {
    for (auto entry = unsynced_entries_.rbegin(); entry != unsynced_entries_.rend(); ++entry) {
      if (entry->from.empty()) {
        folders_.erase(entry->path);
        std::filesystem::remove_all(entry->path);
      } else if (entry->from != entry->path && std::filesystem::exists(entry->path)) {
        FileLayer::rename(entry->path, entry->from);
        move_unsynced(entry->path, entry->from);
      }
      if (entry->before) std::ofstream(entry->path, std::ios::binary) << *entry->before;
    }
    for (const auto& [path, synced] : unsynced_bytes_) {
      if (std::filesystem::exists(path) && std::filesystem::file_size(path) > synced) {
        std::filesystem::resize_file(path, synced);
      }
    }
    keep_all();
  }
  /// All that was done so far is durable.
  void keep_all() {
    unsynced_entries_.clear();
    unsynced_bytes_.clear();
  }

 private:
  /// A change of a folder that it may forget: a new name (`from` is empty), a rename, or a name taken away (both
  /// equal).
  struct Entry {
    std::string path, from;
    std::optional<std::string> before;  // the bytes that the name stood for
  };

  static std::optional<std::string> contents(const std::string& path) {
    if (!std::filesystem::is_regular_file(path)) return {};
    std::ifstream file(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(file), {});
  }
  void move_unsynced(const std::string& from, const std::string& to) {
    if (auto moved = unsynced_bytes_.extract(from); !moved.empty()) unsynced_bytes_[to] = moved.mapped();
  }

  template <class T>
  T step(const char* name, bool interruptible, const std::function<T()>& call) {
    if (dead_ && std::uncaught_exceptions() == 0) throw Killed();
    if (dead_) return fail<T>(EIO);
    const int number = calls++;
    if (number == fail_at) {
      struck_ = true;
      if (error != EINTR) failed_call = name;
      if (error != EINTR || interruptible) return fail<T>(error);
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

  bool dead_ = false, struck_ = false, interrupted_ = false;
  std::map<int, std::string> paths_;
  std::map<std::string, std::uintmax_t> unsynced_bytes_;  // path, and how many of its bytes were synced
  std::vector<Entry> unsynced_entries_;
  std::set<std::string> folders_;
};

}  // namespace kiln::testing
