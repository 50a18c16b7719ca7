#include "core/base/threads.h"

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <thread>

#include "core/base/expects.h"

namespace kiln {

struct Threads::Arena {
  explicit Arena(int count)
      : parallelism(tbb::global_control::max_allowed_parallelism,
                    static_cast<std::size_t>(std::max(count, tbb::this_task_arena::max_concurrency()))),
        arena(count) {}
  tbb::global_control parallelism;
  tbb::task_arena arena;
};

Threads::Threads(int count)
    : arena_(std::make_unique<Arena>(count > 0 ? count
                                               : std::max(1, static_cast<int>(std::thread::hardware_concurrency())))) {
  EXPECTS(count >= 0);
}

Threads::~Threads() = default;

int Threads::count() const { return arena_->arena.max_concurrency(); }

void Threads::for_blocks(std::size_t items, std::size_t block,
                         const std::function<void(std::size_t, std::size_t)>& body) {
  EXPECTS(block > 0);
  check();
  const std::size_t blocks = (items + block - 1) / block;
  arena_->arena.execute([&] {
    tbb::parallel_for(std::size_t{0}, blocks, [&](std::size_t i) {
      check();
      body(i * block, std::min(items, (i + 1) * block));
    });
  });
  check();
}

void Threads::run(const std::function<void()>& body) { arena_->arena.execute(body); }

void Threads::stop_after(double seconds) noexcept {
  end_ = Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

}  // namespace kiln
