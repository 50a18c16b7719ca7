#pragma once
// The two sides of one bake over many workers, as its worker processes see them. The bake itself gives ranges of long
// loops away and computes others meanwhile (GivingLoops); a part runs the same bake from the same inputs, takes what
// earlier loops made from the journal, computes its range, and ends (TakingLoops).
//
// How much is given away is decided by the clock and changes no bit: a loop runs here for a while, and when what is
// left would take long, it is cut into ranges. Each costs its worker what lies between loops once more, so a range
// lasts some times that. Early ranges are larger than late ones, so that all end at about the same time. Where the disk
// has no room for the journal, nothing is given away.

#include <chrono>
#include <exception>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/base/shared_loop.h"
#include "server/work/loop_journal.h"
#include "server/work/worker_protocol.h"

namespace kiln {

/// Cuts around ranges of [first, items), each at least `least` items and whole blocks but for the last one.
std::vector<std::uint64_t> cut_loop(std::uint64_t first, std::uint64_t items, std::uint64_t block, std::uint64_t least);

/// How a worker talks to its supervisor.
struct SupervisorLink {
  std::function<void(const WorkerLine&)> tell;
  std::function<RangeReply(std::uint64_t loop)> ask;  // what to do next; waits for the answer
};

class GivingLoops final : public LoopShares {
 public:
  /// `folder` is where the journal and ranges are written (out/). `known` are ranges that an earlier worker gave away.
  GivingLoops(const Sharing&, std::vector<LoopRange> known, const std::string& folder, SupervisorLink);

  void run(const SharedLoop&, Threads&) override;
  void begin_pass() override;

 private:
  using Clock = std::chrono::steady_clock;
  std::size_t start_here(const SharedLoop&, Threads&, std::vector<std::uint64_t>& cuts) const;
  void join(const SharedLoop&, const std::vector<LoopRange>&, std::size_t done, Threads&);
  std::vector<LoopRange> known_of_loop(const SharedLoop&);
  double least_seconds() const;
  bool keep_journal(const std::function<void(GrowingFile&)>& write);
  std::string store_range(const SharedLoop&, const LoopRange&);

  const Sharing sharing_;
  std::vector<LoopRange> known_;
  const std::string folder_;
  const SupervisorLink link_;
  std::optional<GrowingFile> journal_;  // nothing: no loop is given away any more
  std::uint64_t loop_ = 0;
  int stored_ = 0;                         // ranges that were computed here, of all passes
  Clock::time_point left_ = Clock::now();  // the last loop, or the start
  double between_s_ = 0;                   // loops, since the start of the pass and before the first one
  struct Mark {
    std::uint64_t loop = 0, bytes = 0;
    double between_s = 0;
  };
  std::optional<Mark> first_pass_;
};

/// The range was computed; nothing of the bake after it is needed.
struct RangeDone : std::exception {
  const char* what() const noexcept override { return "the range is done"; }
};

class TakingLoops final : public LoopShares {
 public:
  /// Writes the range to `file`.
  TakingLoops(const LoopRange& range, FileBytes journal, std::string file)
      : range_(range), journal_(std::move(journal)), left_(bytes_of(journal_)), file_(std::move(file)) {}

  void run(const SharedLoop&, Threads&) override;
  void begin_pass() override {}  // a part begins with its pass

 private:
  const LoopRange range_;
  const FileBytes journal_;
  std::span<const std::byte> left_;
  const std::string file_;
  std::uint64_t loop_ = 0;
};

}  // namespace kiln
