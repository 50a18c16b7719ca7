#pragma once
// Large loops whose items may be computed elsewhere. A bake is a pure function of its inputs, so whoever has these
// can run it, take what loops made from a record of them, and compute any items of the next loop: with the same bits.
// Who that is and how ranges travel is LoopShares' business (server/work); without one a loop runs here.

#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/base/threads.h"

namespace kiln {

/// What was computed elsewhere does not fit the loop that asks for it.
struct ForeignLoop : std::exception {
  const char* what() const noexcept override { return "a loop was given items of another"; }
};

/// Items as bytes: native numbers, one after the other. Writes or reads, so that a loop says once what its items are.
class ItemStream {
 public:
  using Sink = std::function<void(std::span<const std::byte>)>;
  explicit ItemStream(Sink sink) : sink_(std::move(sink)) {}
  explicit ItemStream(std::span<const std::byte> bytes) : left_(bytes) {}

  /// Copies `values` out of the loop, or into it. Throws ForeignLoop where there are too few bytes.
  template <class T>
  void pass(std::span<T> values) {
    static_assert(std::is_trivially_copyable_v<T>);
    pass_bytes(std::as_writable_bytes(values));
  }
  template <class T>
  void pass(T& value) {
    pass(std::span<T>(&value, 1));
  }
  /// With its length.
  template <class T>
  void pass(std::vector<T>& values) {
    std::uint64_t count = values.size();
    pass(count);
    if (!sink_ && count > left_.size() / sizeof(T)) throw ForeignLoop();
    values.resize(count);
    pass(std::span<T>(values));
  }

  std::span<const std::byte> left() const { return left_; }

 private:
  void pass_bytes(std::span<std::byte> values);
  Sink sink_;
  std::span<const std::byte> left_;
};

struct SharedLoop {
  const char* name = "";
  std::size_t items = 0;
  std::size_t block = 1;  // ranges begin at multiples of it
  /// Computes a block into the caller's own storage; from any thread, once for each block that is computed here.
  std::function<void(std::size_t begin, std::size_t end)> body;
  /// Passes all that body() made of the items of some blocks.
  std::function<void(std::size_t begin, std::size_t end, ItemStream&)> pass;
  /// Told now and then, never twice at a time; may be empty.
  std::function<void(std::uint64_t done, std::uint64_t all)> progress = {};
};

/// Who else works on the loops of a bake.
class LoopShares {
 public:
  virtual ~LoopShares() = default;
  /// Computes all items, here or elsewhere.
  virtual void run(const SharedLoop&, Threads&) = 0;
  /// A pass of the progressive loop begins: what loops of the last one made is needed no more.
  virtual void begin_pass() = 0;
};

/// Runs a loop with those who share the work of `threads`. Always from the one thread that the bake is in.
void run_loop(const SharedLoop&, Threads& threads);

/// Computes some items here. `done_before` items were done before them.
void compute_items(const SharedLoop&, std::size_t begin, std::size_t end, std::uint64_t done_before, Threads&);

/// Counts of a loop's blocks, each written by the thread that computes the block.
class BlockCounts {
 public:
  BlockCounts(std::size_t items, std::size_t block) : block_(block), counts_((items + block - 1) / block) {}
  std::uint64_t& at(std::size_t begin) { return counts_[begin / block_]; }
  std::uint64_t sum() const;
  void pass(std::size_t begin, std::size_t end, ItemStream& stream) {
    stream.pass(std::span(counts_).subspan(begin / block_, (end - begin + block_ - 1) / block_));
  }

 private:
  std::size_t block_;
  std::vector<std::uint64_t> counts_;
};

}  // namespace kiln
