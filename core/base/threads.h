#pragma once
// The only place where threads are made. Work is cut into fixed blocks, so results never depend on their number.

#include <atomic>
#include <chrono>
#include <cstddef>
#include <exception>
#include <functional>
#include <memory>

namespace kiln {

/// Thrown by Threads::check and for_blocks once stop() was called or its time has come; caught in run_job, the HTTP
/// wrapper and main.
struct Cancelled : std::exception {
  const char* what() const noexcept override { return "cancelled"; }
};

class LoopShares;  // shared_loop.h

class Threads {
 public:
  /// `count` threads work in every for_blocks; 0 means one for each hardware thread.
  explicit Threads(int count = 0);
  ~Threads();
  Threads(const Threads&) = delete;
  Threads& operator=(const Threads&) = delete;

  int count() const;

  /// Calls body(begin, end) for consecutive blocks of at most `block` items that cover [0, items).
  /// Blocks run in any order on any thread; their borders depend on `items` and `block` alone.
  /// Throws Cancelled between blocks after stop(); rethrows what a body throws.
  void for_blocks(std::size_t items, std::size_t block, const std::function<void(std::size_t, std::size_t)>& body);

  /// Runs `body` inside this pool's arena (Embree builds use the same threads).
  void run(const std::function<void()>& body);

  /// Who else works on this bake's large loops (shared_loop.h); null: nobody. Must outlive the bake.
  void share_with(LoopShares* others) { shares_ = others; }
  LoopShares* shares() const { return shares_; }

  /// Safe from any thread and from a signal handler.
  void stop() noexcept { stopping_.store(true, std::memory_order_relaxed); }
  bool stopping() const noexcept { return stopping_.load(std::memory_order_relaxed) || late(); }
  /// As stop(), but not before so many seconds from now; taken back by forever().
  void stop_after(double seconds) noexcept;
  void forever() noexcept { end_ = kNever; }
  void check() const {
    if (stopping()) throw Cancelled();
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr Clock::time_point kNever = Clock::time_point::max();
  bool late() const noexcept {
    const Clock::time_point end = end_.load(std::memory_order_relaxed);
    return end != kNever && Clock::now() >= end;
  }

  struct Arena;
  std::unique_ptr<Arena> arena_;
  LoopShares* shares_ = nullptr;
  std::atomic<bool> stopping_{false};
  std::atomic<Clock::time_point> end_{kNever};
};

}  // namespace kiln
