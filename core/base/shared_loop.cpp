#include "core/base/shared_loop.h"

#include <algorithm>
#include <mutex>
#include <numeric>

#include "core/base/expects.h"

namespace kiln {

void ItemStream::pass_bytes(std::span<std::byte> values) {
  if (sink_) return sink_(values);
  if (values.size() > left_.size()) throw ForeignLoop();
  std::ranges::copy(left_.first(values.size()), values.begin());
  left_ = left_.subspan(values.size());
}

void run_loop(const SharedLoop& loop, Threads& threads) {
  if (threads.shares() != nullptr) {
    threads.shares()->run(loop, threads);
  } else {
    compute_items(loop, 0, loop.items, 0, threads);
  }
}

void compute_items(const SharedLoop& loop, std::size_t begin, std::size_t end, std::uint64_t done_before,
                   Threads& threads) {
  EXPECTS(begin % loop.block == 0 && begin <= end && end <= loop.items);
  std::mutex telling;
  std::uint64_t done = done_before;
  threads.for_blocks(end - begin, loop.block, [&](std::size_t first, std::size_t last) {
    loop.body(begin + first, begin + last);
    if (!loop.progress) return;
    const std::lock_guard lock(telling);
    done += last - first;
    loop.progress(std::min<std::uint64_t>(done, loop.items), loop.items);
  });
}

std::uint64_t BlockCounts::sum() const { return std::accumulate(counts_.begin(), counts_.end(), std::uint64_t{0}); }

}  // namespace kiln
