#include "server/work/shared_bake.h"

#include <algorithm>
#include <filesystem>
#include <system_error>

namespace kiln {
namespace {

constexpr double kTrialS = 1;          // of a loop, before it is judged
constexpr double kStepS = 0.25;        // between two looks at the clock
constexpr double kJournal = 300e6;     // bytes that are stored, fetched and read in a second
constexpr std::uint64_t kShares = 32;  // a range is at most such a part of what is left

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

std::uint64_t whole(std::uint64_t items, std::uint64_t block) { return (items + block - 1) / block * block; }

}  // namespace

std::vector<std::uint64_t> cut_loop(std::uint64_t first, std::uint64_t items, std::uint64_t block,
                                    std::uint64_t least) {
  std::vector<std::uint64_t> cuts{first};
  while (cuts.back() < items) {
    const std::uint64_t left = items - cuts.back();
    const std::uint64_t size = whole(std::max({least, left / kShares, std::uint64_t{1}}), block);
    cuts.push_back(left < size + size / 2 ? items : cuts.back() + size);
  }
  return cuts;
}

GivingLoops::GivingLoops(const Sharing& sharing, std::vector<LoopRange> known, const std::string& folder,
                         SupervisorLink link)
    : sharing_(sharing),
      known_(std::move(known)),
      folder_(folder),
      link_(std::move(link)),
      journal_(std::in_place, folder + "/journal") {}

void GivingLoops::run(const SharedLoop& loop, Threads& threads) {
  if (!journal_) return compute_items(loop, 0, loop.items, 0, threads);
  between_s_ += seconds_since(left_);
  std::vector<LoopRange> ranges = known_of_loop(loop);
  std::size_t done = 0;
  if (ranges.empty()) {
    std::vector<std::uint64_t> cuts;
    done = start_here(loop, threads, cuts);
    for (std::size_t k = 0; k + 1 < cuts.size(); ++k) ranges.push_back({loop_, cuts[k], cuts[k + 1]});
    if (!ranges.empty()) {
      if (!keep_journal([](GrowingFile& journal) { journal.flush(); }))
        return compute_items(loop, done, loop.items, done, threads);
      link_.tell(WorkerShare{loop_, loop.name, journal_->bytes(), std::move(cuts)});
    }
  } else {
    done = ranges.front().first;
    compute_items(loop, 0, done, 0, threads);
  }
  if (!ranges.empty()) join(loop, ranges, done, threads);
  keep_journal([&](GrowingFile& journal) { write_record(journal, loop, {loop_, 0, loop.items}); });
  ++loop_;
  left_ = Clock::now();
}

/// False when there is no room for it: nothing is given away any more.
bool GivingLoops::keep_journal(const std::function<void(GrowingFile&)>& write) {
  try {
    write(*journal_);
    if (journal_->bytes() <= kMostJournal) return true;
  } catch (const std::system_error&) {
  }
  journal_.reset();
  std::error_code none;
  std::filesystem::resize_file(folder_ + "/journal", 0, none);
  return false;
}

/// Ranges that an earlier worker gave away, if they end this loop.
std::vector<LoopRange> GivingLoops::known_of_loop(const SharedLoop& loop) {
  std::vector<LoopRange> ranges;
  for (const LoopRange& range : known_) {
    if (range.loop == loop_) ranges.push_back(range);
  }
  std::ranges::sort(ranges, {}, &LoopRange::first);
  for (std::size_t k = 0; k < ranges.size(); ++k) {
    const std::uint64_t next = k + 1 < ranges.size() ? ranges[k + 1].first : loop.items;
    if (ranges[k].last != next || ranges[k].first % loop.block != 0) return {};
  }
  return ranges;
}

/// Seconds of the shortest range that is worth its way.
double GivingLoops::least_seconds() const {
  return std::max(sharing_.least_s,
                  sharing_.repeats * (between_s_ + static_cast<double>(journal_->bytes()) / kJournal));
}

/// Computes items, all of them unless what is left is long: then it is cut. Returns how many were computed.
std::size_t GivingLoops::start_here(const SharedLoop& loop, Threads& threads, std::vector<std::uint64_t>& cuts) const {
  const Clock::time_point start = Clock::now();
  std::size_t done = 0, step = loop.block * static_cast<std::size_t>(threads.count());
  while (done < loop.items) {
    const std::size_t end = std::min(loop.items, done + step);
    compute_items(loop, done, end, done, threads);
    done = end;
    const double seconds = seconds_since(start);
    const double a_second = static_cast<double>(done) / std::max(seconds, 1e-6);  // items
    step = std::max(step, whole(static_cast<std::size_t>(a_second * std::min(kStepS, sharing_.least_s)), loop.block));
    if (seconds < std::min(kTrialS, sharing_.least_s)) continue;
    const double least = least_seconds(), left = static_cast<double>(loop.items - done) / a_second;
    if (left > 2 * least) {
      cuts = cut_loop(done, loop.items, loop.block, static_cast<std::uint64_t>(least * a_second));
      return done;
    }
    step = loop.items - done;  // the rest is short
  }
  return done;
}

/// Computes ranges and takes those of others until there are none left.
void GivingLoops::join(const SharedLoop& loop, const std::vector<LoopRange>& ranges, std::size_t done,
                       Threads& threads) {
  std::vector<LoopRange> left = ranges;
  while (!left.empty()) {
    const RangeReply reply = link_.ask(loop_);
    const auto found = std::ranges::find(left, reply.range);
    if (found == left.end()) throw ForeignLoop();
    const auto [number, first, last] = reply.range;
    if (reply.file.empty()) {
      compute_items(loop, first, last, done, threads);
      link_.tell(WorkerMade{reply.range, store_range(loop, reply.range)});
    } else {
      auto file = FileBytes::map(reply.file, "range");
      if (!file) throw ForeignLoop();
      if (!read_record(bytes_of(*file), loop, {number, first, last}).empty()) throw ForeignLoop();
    }
    left.erase(found);
    done += last - first;
    if (loop.progress) loop.progress(done, loop.items);
    threads.check();
  }
}

/// For a successor. Its name; empty when there is no room for it.
std::string GivingLoops::store_range(const SharedLoop& loop, const LoopRange& range) {
  std::string name = "range." + std::to_string(stored_++);
  const std::string file = folder_ + "/" + name;
  try {
    GrowingFile made(file);
    write_record(made, loop, {range.loop, range.first, range.last});
    made.flush();
    return name;
  } catch (const std::system_error&) {
    std::error_code none;
    std::filesystem::remove(file, none);
    return "";
  }
}

void GivingLoops::begin_pass() {
  between_s_ += seconds_since(left_);
  left_ = Clock::now();
  if (!journal_) return;
  if (!first_pass_) {
    first_pass_ = Mark{loop_, journal_->bytes(), between_s_};
    return;
  }
  loop_ = first_pass_->loop;
  between_s_ = first_pass_->between_s;
  keep_journal([&](GrowingFile& journal) { journal.shrink(first_pass_->bytes); });
  known_.clear();  // of an earlier pass
}

void TakingLoops::run(const SharedLoop& loop, Threads& threads) {
  if (loop_ < range_.loop) {
    left_ = read_record(left_, loop, {loop_, 0, loop.items});
    ++loop_;
    return;
  }
  if (range_.last > loop.items || range_.first % loop.block != 0) throw ForeignLoop();
  compute_items(loop, range_.first, range_.last, 0, threads);
  GrowingFile made(file_);
  write_record(made, loop, {range_.loop, range_.first, range_.last});
  made.flush();
  throw RangeDone();
}

}  // namespace kiln
