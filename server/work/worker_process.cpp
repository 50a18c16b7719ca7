#include "server/work/worker_process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <utility>

#include "server/work/worker_protocol.h"

namespace kiln {
namespace {

constexpr std::size_t kMaxLine = 64 * 1024;
constexpr rlim_t kMaxFiles = 256;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kLimitAddressSpace = false;  // sanitizers reserve terabytes
#else
constexpr bool kLimitAddressSpace = true;
#endif

tl::unexpected<Fault> spawn_fault() { return fault("spawn_failed", "the server could not start a worker process"); }

/// posix_spawn's settings, freed at the end.
struct SpawnSettings {
  posix_spawn_file_actions_t files{};
  posix_spawnattr_t attributes{};
  SpawnSettings() {
    posix_spawn_file_actions_init(&files);
    posix_spawnattr_init(&attributes);
  }
  ~SpawnSettings() {
    posix_spawn_file_actions_destroy(&files);
    posix_spawnattr_destroy(&attributes);
  }
  SpawnSettings(const SpawnSettings&) = delete;
  SpawnSettings& operator=(const SpawnSettings&) = delete;
};

bool set_files(SpawnSettings& settings, const WorkerStart& start, int pipe) {
  auto* files = &settings.files;
  const std::string log = start.folder / "worker.log";
  const int input = start.input >= 0 ? posix_spawn_file_actions_adddup2(files, start.input, 0)
                                     : posix_spawn_file_actions_addopen(files, 0, "/dev/null", O_RDONLY, 0);
  return input == 0 &&
         posix_spawn_file_actions_addopen(files, 2, log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600) == 0 &&
         posix_spawn_file_actions_adddup2(files, 2, 1) == 0 &&
         posix_spawn_file_actions_adddup2(files, pipe, kWorkerPipe) == 0 &&
         posix_spawn_file_actions_addclosefrom_np(files, kWorkerPipe + 1) == 0 &&  // whatever else the server has open
         posix_spawn_file_actions_addchdir_np(files, start.folder.c_str()) == 0;
}

bool set_attributes(SpawnSettings& settings) {
  sigset_t none, all;
  sigemptyset(&none);
  sigfillset(&all);
  return posix_spawnattr_setsigmask(&settings.attributes, &none) == 0 &&
         posix_spawnattr_setsigdefault(&settings.attributes, &all) == 0 &&
         posix_spawnattr_setpgroup(&settings.attributes, 0) == 0 &&
         posix_spawnattr_setflags(&settings.attributes,
                                  POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP) == 0;
}

/// Few variables and no secrets of the server.
std::vector<std::string> clean_environment() {
  std::vector<std::string> kept{"LC_ALL=C", "PATH=/usr/bin:/bin"};
  for (const char* name : {"LD_LIBRARY_PATH", "ASAN_OPTIONS", "TSAN_OPTIONS", "UBSAN_OPTIONS"}) {
    if (const char* value = std::getenv(name)) kept.push_back(std::string(name) + "=" + value);
  }
  return kept;
}

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> result;
  for (std::string& text : texts) result.push_back(text.data());
  result.push_back(nullptr);
  return result;
}

/// Sets a limit, or keeps what is stricter already.
template <class Resource>
bool lower(pid_t pid, Resource resource, rlimit wanted) {
  rlimit now{};
  if (::prlimit(pid, resource, nullptr, &now) != 0) return false;
  wanted.rlim_max = std::min(wanted.rlim_max, now.rlim_max);
  wanted.rlim_cur = std::min(wanted.rlim_cur, wanted.rlim_max);
  return ::prlimit(pid, resource, &wanted, nullptr) == 0;
}

/// From outside, so that it holds for every program that may be the worker. It may run for some milliseconds by then:
/// time, files and memory that it used before count all the same.
bool limit(pid_t pid, const WorkerStart& start) {
  bool set = lower(pid, RLIMIT_CORE, {0, 0}) && lower(pid, RLIMIT_NOFILE, {kMaxFiles, kMaxFiles});
  if (start.cpu_s > 0) {
    const auto seconds = static_cast<rlim_t>(start.cpu_s) + 1;
    set = set && lower(pid, RLIMIT_CPU, {seconds, seconds + 5});  // SIGXCPU, and KILL for who passes over it
  }
  if (!kLimitAddressSpace || start.memory_bytes == 0) return set;
  // Allocators and thread stacks reserve more than they use; resident memory is watched by the supervisor.
  // A scene is mapped, and what a reduction puts aside of it may be as large again.
  const rlim_t space = 2 * start.memory_bytes + 2 * start.mapped_bytes + (4ULL << 30);
  // No file of its is larger than that: all that it writes was in its memory or its scene.
  return set && lower(pid, RLIMIT_AS, {space, space}) && lower(pid, RLIMIT_FSIZE, {space, space});
}

}  // namespace

Result<WorkerProcess> WorkerProcess::start(const WorkerStart& start) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return spawn_fault();
  ::fcntl(ends[0], F_SETFL, O_NONBLOCK);
  SpawnSettings settings;
  const bool set = set_files(settings, start, ends[1]) && set_attributes(settings);
  std::vector<std::string> arguments = start.command;
  if (arguments.empty()) arguments = {"/proc/self/exe", kWorkerWord};
  const std::string program = arguments.front();
  if (start.command.empty()) arguments.front() = "kilnd";
  arguments.push_back(start.folder);
  std::vector<std::string> environment = clean_environment();
  pid_t pid = 0;
  const bool started = set && ::posix_spawn(&pid, program.c_str(), &settings.files, &settings.attributes,
                                            pointers(arguments).data(), pointers(environment).data()) == 0;
  ::close(ends[1]);
  if (!started) {
    ::close(ends[0]);
    return spawn_fault();
  }
  const bool limited = limit(pid, start);
  WorkerProcess worker(pid, ends[0], static_cast<int>(::syscall(SYS_pidfd_open, pid, 0)));
  if (!limited || worker.end_ < 0) return spawn_fault();  // the destructor ends it
  ::fcntl(worker.end_, F_SETFD, FD_CLOEXEC);
  return worker;
}

WorkerProcess::WorkerProcess(WorkerProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)),
      pipe_(std::exchange(other.pipe_, -1)),
      end_(std::exchange(other.end_, -1)),
      status_(other.status_),
      partial_(std::move(other.partial_)) {}

WorkerProcess::~WorkerProcess() {
  if (pid_ > 0 && !status_) {
    signal(SIGKILL);
    while (::waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
    }
  }
  if (pipe_ >= 0) ::close(pipe_);
  if (end_ >= 0) ::close(end_);
}

std::vector<std::string> WorkerProcess::read_lines() {
  std::vector<std::string> lines;
  std::array<char, 16 * 1024> piece{};
  while (pipe_ >= 0) {
    const ssize_t got = ::read(pipe_, piece.data(), piece.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) break;
    if (got == 0) {
      ::close(std::exchange(pipe_, -1));
      break;
    }
    partial_.append(piece.data(), static_cast<std::size_t>(got));
    for (std::size_t end; (end = partial_.find('\n')) != std::string::npos; partial_.erase(0, end + 1)) {
      lines.push_back(partial_.substr(0, end));
    }
    if (partial_.size() > kMaxLine) lines.push_back(std::exchange(partial_, {}));
  }
  return lines;
}

std::optional<int> WorkerProcess::try_wait() {
  if (status_) return status_;
  siginfo_t info{};
  if (::waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) != 0 || info.si_pid == 0) return {};
  signal(SIGKILL);  // stragglers of its group, while its number is still its own
  int status = 0;
  ::waitpid(pid_, &status, 0);
  return status_ = status;
}

void WorkerProcess::signal(int number) const { ::kill(-pid_, number); }

std::uint64_t WorkerProcess::resident_bytes() const {
  std::ifstream file("/proc/" + std::to_string(pid_) + "/statm");
  std::uint64_t total = 0, resident = 0, of_files = 0;
  file >> total >> resident >> of_files;
  return (resident - std::min(resident, of_files)) * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

}  // namespace kiln
