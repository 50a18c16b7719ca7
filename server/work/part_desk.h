#pragma once
// Stands between a bake whose loops are shared and the queue: stores the ranges that its worker gives away as jobs of
// their own, tells the worker what to do next, and fetches what others made. Whatever goes wrong with a range, the
// worker computes it itself: sharing may cost time and never a result.

#include <array>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <optional>
#include <queue>
#include <string>
#include <thread>
#include <vector>

#include "server/work/maker.h"
#include "server/work/run_job.h"
#include "server/work/worker_protocol.h"

namespace kiln {

class PartDesk {
 public:
  /// `checkpoint` is that of the pass which the worker begins with; parts of other passes are forgotten, and those of
  /// servers that make other bits: the job was theirs before.
  PartDesk(const Claim&, const WorkPlace&, std::filesystem::path folder, std::string checkpoint);
  ~PartDesk();
  PartDesk(const PartDesk&) = delete;
  PartDesk& operator=(const PartDesk&) = delete;

  /// Ranges that an earlier worker of this job gave away in this pass.
  const std::vector<LoopRange>& known() const { return known_; }
  /// Where the worker reads answers: its descriptor 0. Negative when there is none to be had: it cannot share then.
  int worker_end() const { return ends_[0]; }

  /// From the thread that listens to the worker; never waits. False: no worker that waits for its answers says so much.
  bool hear(const WorkerLine& line);
  void pass_ended(const std::string& checkpoint);

 private:
  struct News {
    std::optional<WorkerLine> line;  // nothing: a pass ended
    std::string checkpoint;
  };
  void work();
  std::optional<News> wait_for_news();
  void handle(const News&);
  void share(const WorkerShare&);
  Result<void> give_away(const WorkerShare&);
  void answer(std::uint64_t loop);
  std::optional<RangeReply> find_next();
  bool hold(const std::string& part);
  RangeReply fetch(const PartState&, const LoopRange&);
  void keep(const WorkerMade&);
  Result<void> store_made(const WorkerMade&, const ClaimRef& part);
  void beat();
  void send(const RangeReply&);
  bool stopping() const;

  const Claim& claim_;
  const WorkPlace& place_;
  const std::filesystem::path folder_;
  const std::string maker_ = maker_word();
  std::string checkpoint_;
  std::vector<LoopRange> known_;
  std::array<int, 2> ends_{-1, -1};

  std::optional<std::uint64_t> loop_;   // that was asked for last,
  std::vector<LoopRange> open_;         // and its ranges that the worker has not got
  std::size_t given_away_ = 0;          // ranges, by this worker
  std::size_t fetched_ = 0;             // ranges of others
  std::filesystem::path last_fetched_;  // that the worker reads now
  std::optional<Claim> held_;           // the range that the worker computes, where it is in the store
  std::chrono::steady_clock::time_point beaten_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool over_ = false;
  std::queue<News> news_;
  std::thread thread_;
};

}  // namespace kiln
