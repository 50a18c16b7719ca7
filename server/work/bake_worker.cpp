#include "server/work/bake_worker.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <map>
#include <new>
#include <optional>
#include <span>
#include <system_error>
#include <thread>

#include "core/bake/bake.h"
#include "core/base/file_bytes.h"
#include "core/base/threads.h"
#include "server/work/sandbox.h"
#include "server/work/shared_bake.h"
#include "server/work/worker_protocol.h"

namespace kiln {
namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kTellEvery = std::chrono::milliseconds(50);

/// A trouble that ends the job with a fault of its own, from deep within file handling.
struct WorkerTrouble {
  Fault fault;
};

void write_all(int fd, const void* data, std::size_t size) {
  for (const auto* bytes = static_cast<const char*>(data); size > 0;) {
    const ssize_t put = ::write(fd, bytes, size);
    if (put < 0 && errno == EINTR) continue;
    if (put < 0 && errno == ENOSPC) throw WorkerTrouble{{"disk_full", "the disk of the server is full", ""}};
    if (put < 0) throw WorkerTrouble{{"internal", "the worker could not write", ""}};
    bytes += put;
    size -= static_cast<std::size_t>(put);
  }
}

void tell(const WorkerLine& line) {
  const std::string text = line_json(line);
  write_all(kWorkerPipe, text.data(), text.size());
}

/// The files of a job, opened before the worker is locked in: from then on these descriptors are its only way to them.
class InputFiles {
 public:
  /// `job.json` and all of `inputs/`.
  explicit InputFiles(const std::filesystem::path& folder) {
    add(folder, kOrderFile);
    for (const auto& entry : std::filesystem::directory_iterator(folder / "inputs"))
      add(folder, "inputs/" + entry.path().filename().string());
  }
  ~InputFiles() {
    for (const auto& [name, file] : files_) ::close(file);
  }
  InputFiles(const InputFiles&) = delete;
  InputFiles& operator=(const InputFiles&) = delete;

  Bytes read(const std::string& name) const {
    const FileBytes mapped = map(name);
    const std::span<const std::uint8_t> bytes = mapped;
    return {bytes.begin(), bytes.end()};
  }
  /// Blobs never change: they may be mapped.
  FileBytes map(const std::string& name) const {
    const auto found = files_.find(name);
    auto bytes = FileBytes::map(found == files_.end() ? -1 : found->second, "scene");
    if (!bytes) throw unreadable();
    return std::move(*bytes);
  }

  static constexpr const char* kOrderFile = "job.json";

 private:
  static WorkerTrouble unreadable() { return {{"internal", "the worker could not read an input", ""}}; }
  void add(const std::filesystem::path& folder, const std::string& name) {
    const int file = ::open((folder / name).c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    if (file < 0) throw unreadable();
    files_[name] = file;
  }

  std::map<std::string, int> files_;
};

void write_file(const std::string& path, const void* data, std::size_t size) {
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (fd < 0) throw WorkerTrouble{{errno == ENOSPC ? "disk_full" : "internal", "the worker could not write", ""}};
  write_all(fd, data, size);
  ::close(fd);
}

WorkerOrder read_order(const InputFiles& files) {
  const Bytes text = files.read(InputFiles::kOrderFile);
  auto order = parse_order({reinterpret_cast<const char*>(text.data()), text.size()});
  if (!order) throw WorkerTrouble{order.error()};
  return *order;
}

BakeInput read_input(const WorkerOrder& order, const InputFiles& files) {
  auto recipe = parse_recipe(order.recipe);
  if (!recipe) throw WorkerTrouble{{"internal", "the worker did not understand its recipe", ""}};
  BakeInput input;
  input.spill_folder = "out";  // the only place that the sandbox lets it write to
  input.recipe = std::move(*recipe);
  std::size_t place = 0;
  input.scene.name = order.inputs.scene.name;
  input.scene.main = files.map(input_path(place));
  for (const NamedBlob& file : order.inputs.resources) {
    input.scene.resources[file.name] = files.read(input_path(++place));
  }
  if (order.inputs.environment) {
    input.environment_name = order.inputs.environment->name;
    input.environment = files.read(input_path(++place));
  }
  return input;
}

/// Stops `threads` on TERM, which every thread of this process blocks.
class TermWatch {
 public:
  explicit TermWatch(Threads& threads)
      : thread_([this, &threads] {
          for (int received = 0; ::sigwait(&set(), &received) == 0 && !over_;) threads.stop();
        }) {}
  ~TermWatch() {
    over_ = true;
    ::pthread_kill(thread_.native_handle(), SIGTERM);  // NOLINT(bugprone-bad-signal-to-kill-thread): ends its sigwait
    thread_.join();
  }
  TermWatch(const TermWatch&) = delete;
  TermWatch& operator=(const TermWatch&) = delete;

  static const sigset_t& set() {
    static const sigset_t term = [] {
      sigset_t s;
      sigemptyset(&s);
      sigaddset(&s, SIGTERM);
      return s;
    }();
    return term;
  }

 private:
  std::atomic<bool> over_{false};
  std::thread thread_;
};

Progress progress_to_pipe() {
  return [told = Clock::time_point{}, stage = std::string()](const ProgressEvent& event) mutable {
    const auto now = Clock::now();
    if (event.stage == stage && now - told < kTellEvery) return;
    told = now;
    stage = event.stage;
    tell(event);
  };
}

/// What the supervisor says, a line at a time, on descriptor 0.
class Answers {
 public:
  explicit Answers(const Threads& threads) : threads_(threads) {}

  std::string line() {
    for (std::size_t end = 0; (end = text_.find('\n')) == std::string::npos;) {
      threads_.check();
      pollfd what{STDIN_FILENO, POLLIN, 0};
      if (::poll(&what, 1, kLookEveryMs) <= 0) continue;
      std::array<char, 4096> piece{};
      const ssize_t got = ::read(STDIN_FILENO, piece.data(), piece.size());
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) throw WorkerTrouble{{"internal", "the supervisor is gone", ""}};
      text_.append(piece.data(), static_cast<std::size_t>(got));
    }
    const std::size_t end = text_.find('\n');
    std::string first = text_.substr(0, end);
    text_.erase(0, end + 1);
    return first;
  }

 private:
  static constexpr int kLookEveryMs = 200;
  const Threads& threads_;
  std::string text_;
};

RangeReply ask_next(std::uint64_t loop, Answers& answers) {
  tell(WorkerNext{loop});
  auto reply = parse_reply(answers.line());
  if (!reply) throw WorkerTrouble{reply.error()};
  return *reply;
}

int refuse(const Fault& fault) {
  tell(fault);
  return kExitRefused;
}

int make_plan(const BakeInput& input, Threads& threads) {
  const auto plan = plan_json(input, threads);
  if (!plan) return refuse(plan.error());
  write_file("out/plan.json", plan->data(), plan->size());
  tell(WorkerDone{});
  return kExitDone;
}

Result<BakeOutput> bake_order(const BakeInput& input, const WorkerOrder& order, Threads& threads) {
  return bake(input, progress_to_pipe(), threads,
              {order.checkpoint, [](const std::string& text) { tell(WorkerCheckpoint{text}); }});
}

int make_bake(const BakeInput& input, const WorkerOrder& order, Threads& threads) {
  Answers answers(threads);
  std::optional<GivingLoops> loops;
  if (order.sharing.least_s > 0) {
    const SupervisorLink link{tell, [&](std::uint64_t loop) { return ask_next(loop, answers); }};
    threads.share_with(&loops.emplace(order.sharing, order.known, "out", link));
  }
  const auto output = bake_order(input, order, threads);
  if (!output) return refuse(output.error());
  for (const ArtifactFile& file : output->files) {
    write_file("out/" + file.name, file.bytes.data(), file.bytes.size());
    tell(WorkerArtifact{file.name, file.media_type});
  }
  tell(WorkerDone{});
  return kExitDone;
}

int make_part(const BakeInput& input, const WorkerOrder& order, const InputFiles& files, Threads& threads) try {
  if (!order.range) throw WorkerTrouble{{"internal", "the worker was given no range", ""}};
  TakingLoops loops(*order.range, files.map("inputs/journal"), "out/range");
  threads.share_with(&loops);
  const auto output = bake_order(input, order, threads);
  if (!output) return refuse(output.error());
  return refuse({"no_such_range", "the bake has no loop of this number", ""});
} catch (const RangeDone&) {
  tell(WorkerArtifact{"range", "application/octet-stream"});
  tell(WorkerDone{});
  return kExitDone;
}

/// Dies with the supervisor, also when that was gone before the request reached the kernel.
void tie_to_parent(int parent) {
  if (::prctl(PR_SET_PDEATHSIG, SIGKILL) != 0 || ::getppid() != parent) std::_Exit(kExitCanceled);
}

int run_order(const Sandbox& sandbox, const InputFiles& files) {
  const WorkerOrder order = read_order(files);
  tie_to_parent(order.parent);
  if (order.require_sandbox && !sandbox.whole()) {
    throw WorkerTrouble{{"internal", "this machine gives workers no sandbox, and the server demands one", ""}};
  }
  Threads threads(order.threads);
  const TermWatch watch(threads);
  const BakeInput input = read_input(order, files);
  switch (order.mode) {
    case WorkerMode::plan:
      return make_plan(input, threads);
    case WorkerMode::part:
      return make_part(input, order, files, threads);
    case WorkerMode::bake:
      break;
  }
  return make_bake(input, order, threads);
}

int failed(const Fault& fault) try {
  tell(fault);
  return kExitInternal;
} catch (...) {
  return kExitInternal;  // the supervisor is gone
}

}  // namespace

int bake_worker_main(int argc, char** argv) try {
  ::pthread_sigmask(SIG_BLOCK, &TermWatch::set(), nullptr);
  ::signal(SIGPIPE, SIG_IGN);
  if (argc != 2 || ::chdir(argv[1]) != 0) return kExitInternal;
  const InputFiles files(argv[1]);
  return run_order(enter_sandbox(argv[1]), files);
} catch (const Cancelled&) {
  return kExitCanceled;
} catch (const WorkerTrouble& trouble) {
  return failed(trouble.fault);
} catch (const std::system_error& error) {
  const bool full = error.code() == std::errc::no_space_on_device;
  return failed(
      {full ? "disk_full" : "internal", full ? "the disk of the server is full" : "the worker could not write", ""});
} catch (const std::bad_alloc&) {
  return failed({"out_of_memory", "the job needed more memory than its limit allows", "/limits/memory_mb"});
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());  // to worker.log, for us alone
  return failed({"internal", "the bake failed by a fault of the program", ""});
}

}  // namespace kiln
