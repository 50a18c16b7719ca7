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

#include "server/work/run_job.h"
#include "server/work/worker_protocol.h"

namespace kiln {

class PartDesk {
 public:
  /// `checkpoint` is that of the pass which the worker begins with; parts of other passes are forgotten.
  PartDesk(const Claim&, const WorkPlace&, std::filesystem::path folder, std::string checkpoint);
  ~PartDesk();
  PartDesk(const PartDesk&) = delete;
  PartDesk& operator=(const PartDesk&) = delete;

  /// Ranges that an earlier worker of this job gave away in this pass.
  const std::vector<LoopRange>& known() const { return known_; }
  /// Where the worker reads answers: its descriptor 0.
  int worker_end() const { return ends_[0]; }

  /// From the thread that listens to the worker; never waits.
  void hear(const WorkerLine& line);
  void pass_ended(const std::string& checkpoint);

 private:
  struct News {
    std::optional<WorkerLine> line;  // nothing: a pass ended
    std::string checkpoint;
  };
  void put(News news);
  void work();
  std::optional<News> wait_for_news();
  void handle(const News&);
  void share(const WorkerShare&);
  Result<void> give_away(const WorkerShare&);
  void answer(std::uint64_t loop);
  std::optional<RangeReply> find_next(std::uint64_t loop);
  bool hold(const std::string& part);
  std::optional<RangeReply> fetch(const PartState&, const LoopRange&);
  void keep(const WorkerMade&);
  void beat();
  void send(const RangeReply&);
  bool stopping() const;

  const Claim& claim_;
  const WorkPlace& place_;
  const std::filesystem::path folder_;
  std::string checkpoint_;
  std::vector<LoopRange> known_;
  std::array<int, 2> ends_{-1, -1};

  std::vector<LoopRange> open_;  // ranges that the worker has not got
  std::optional<Claim> held_;    // the range that the worker computes, where it is in the store
  std::chrono::steady_clock::time_point beaten_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool over_ = false;
  std::queue<News> news_;
  std::thread thread_;
};

}  // namespace kiln
