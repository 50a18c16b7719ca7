#include "server/work/part_desk.h"

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <map>
#include <string_view>
#include <utility>

#include "server/work/data_folder.h"

namespace kiln {
namespace {

constexpr Millis kLookEvery{500};             // news of other servers may get lost: this is the truth
constexpr Millis kRest{100};                  // between two looks: the progress of every job here is news
constexpr std::size_t kMostNews = 16;         // a worker waits for its answers: more is not said at a time
constexpr std::size_t kMostRanges = 1 << 14;  // of a worker: rows of the store

/// A file of the worker's, who is not to be trusted: no link is followed, and only a regular file is read.
class WorkerFile {
 public:
  explicit WorkerFile(const std::filesystem::path& file)
      : fd_(::open(file.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC)) {}
  ~WorkerFile() {
    if (fd_ >= 0) ::close(fd_);
  }
  WorkerFile(const WorkerFile&) = delete;
  WorkerFile& operator=(const WorkerFile&) = delete;
  bool has(std::uint64_t bytes) const {
    struct stat status {};
    return fd_ >= 0 && ::fstat(fd_, &status) == 0 && S_ISREG(status.st_mode) &&
           static_cast<std::uint64_t>(status.st_size) >= bytes;
  }
  /// The next bytes, as many as fit; nothing at the end of the file.
  std::span<const std::uint8_t> read(std::span<std::uint8_t> piece) const {
    ssize_t got = 0;
    do got = ::read(fd_, piece.data(), piece.size());
    while (got < 0 && errno == EINTR);
    return piece.first(static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
  }

 private:
  int fd_;
};

/// The first bytes of a file that its writer goes on with.
Result<StoredBlob> store_copy(BlobStore& blobs, const std::filesystem::path& file, std::uint64_t bytes,
                              const std::function<bool()>& stopping) {
  const WorkerFile in(file);
  if (bytes > kMostJournal || !in.has(bytes)) return fault("io_failed", "the journal of a bake cannot be read");
  KILN_TRY(writer, blobs.write());
  std::vector<std::uint8_t> buffer(1 << 20);
  for (std::uint64_t left = bytes; left > 0;) {
    const auto piece = in.read(std::span(buffer).first(std::min<std::uint64_t>(left, buffer.size())));
    if (piece.empty() || stopping()) return fault("io_failed", "the journal of a bake was not read to its end");
    if (auto wrote = writer.write(piece); !wrote) return tl::make_unexpected(wrote.error());
    left -= piece.size();
  }
  return writer.finish();
}

}  // namespace

PartDesk::PartDesk(const Claim& claim, const WorkPlace& place, std::filesystem::path folder, std::string checkpoint)
    : claim_(claim), place_(place), folder_(std::move(folder)), checkpoint_(std::move(checkpoint)) {
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends_.data()) != 0) return;
  bool foreign = false;
  for (const PartState& part : place_.store.parts(claim_.ref.job_id).value_or(std::vector<PartState>{})) {
    const auto order = parse_part(part.order);
    if (!order || order->checkpoint != checkpoint_ || part.maker != maker_) {
      foreign = true;
    } else {
      known_.push_back(order->range);
    }
  }
  if (foreign) {
    static_cast<void>(place_.store.forget_parts(claim_.ref));
    known_.clear();
  }
  thread_ = std::thread([this] { work(); });
}

PartDesk::~PartDesk() {
  {
    const std::lock_guard lock(mutex_);
    over_ = true;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
  if (held_) static_cast<void>(place_.store.release(held_->ref));
  for (const int end : ends_) {
    if (end >= 0) ::close(end);
  }
}

bool PartDesk::hear(const WorkerLine& line) {
  const std::lock_guard lock(mutex_);
  if (news_.size() >= kMostNews) return false;
  news_.push({line, {}});
  changed_.notify_all();
  return true;
}

void PartDesk::pass_ended(const std::string& checkpoint) {
  const std::lock_guard lock(mutex_);
  if (news_.empty() || news_.back().line) news_.emplace();
  news_.back().checkpoint = checkpoint;
  changed_.notify_all();
}

bool PartDesk::stopping() const {
  const std::lock_guard lock(mutex_);
  return over_ || place_.bus.closed();
}

void PartDesk::work() {
  while (const auto news = wait_for_news()) handle(*news);
}

/// Meanwhile the range that the worker computes stays its own.
std::optional<PartDesk::News> PartDesk::wait_for_news() {
  std::unique_lock lock(mutex_);
  while (!over_) {
    if (!news_.empty()) {
      News first = std::move(news_.front());
      news_.pop();
      return first;
    }
    changed_.wait_for(lock, place_.options.lease / 4);
    lock.unlock();
    beat();
    lock.lock();
  }
  return std::nullopt;
}

void PartDesk::beat() {
  const auto now = std::chrono::steady_clock::now();
  if (!held_ || now - beaten_ < place_.options.lease / 4) return;
  beaten_ = now;
  static_cast<void>(place_.store.heartbeat(held_->ref, place_.options.lease, std::nullopt));
}

void PartDesk::handle(const News& news) {
  if (!last_fetched_.empty()) {  // the worker has read it
    std::error_code none;
    std::filesystem::remove(std::exchange(last_fetched_, {}), none);
  }
  if (!news.line) {
    checkpoint_ = news.checkpoint;
    static_cast<void>(place_.store.forget_parts(claim_.ref));
    loop_.reset();
    open_.clear();
  } else if (const auto* given = std::get_if<WorkerShare>(&*news.line)) {
    share(*given);
  } else if (const auto* made = std::get_if<WorkerMade>(&*news.line)) {
    keep(*made);
  } else if (const auto* next = std::get_if<WorkerNext>(&*news.line)) {
    answer(next->loop);
  }
}

void PartDesk::share(const WorkerShare& given) {
  loop_ = given.loop;
  open_.clear();
  for (std::size_t k = 0; k + 1 < given.cuts.size(); ++k)
    open_.push_back({given.loop, given.cuts[k], given.cuts[k + 1]});
  static_cast<void>(give_away(given));  // what is not in the store is left to the worker
  place_.bus.announce();
}

Result<void> PartDesk::give_away(const WorkerShare& given) {
  if (given_away_ + open_.size() > kMostRanges) return fault("too_many", "the bake gave away too many ranges");
  given_away_ += open_.size();
  if (disk_space(place_.blobs.folder()).free_fraction < place_.options.soft_free_fraction)
    return fault("disk_full", "the disk is nearly full: nothing more is given away");
  KILN_TRY(gate, place_.store.enter_blob_gate());
  KILN_TRY(journal,
           store_copy(place_.blobs, folder_ / "out" / "journal", given.journal_bytes, [this] { return stopping(); }));
  NewParts parts{{}, maker_, {journal.sha256, journal.bytes}};
  for (const LoopRange& range : open_) parts.orders.push_back(part_json({range, checkpoint_}));
  KILN_TRY(added, place_.store.add_parts(claim_.ref, parts));
  static_cast<void>(added);
  return {};
}

void PartDesk::answer(std::uint64_t loop) {
  if (loop != loop_) {
    loop_ = loop;
    open_.clear();
    std::ranges::copy_if(known_, std::back_inserter(open_), [&](const LoopRange& range) { return range.loop == loop; });
  }
  while (!stopping()) {
    const std::uint64_t seen = place_.bus.ticks();
    if (const auto reply = find_next()) return send(*reply);
    place_.bus.wait(seen, std::chrono::steady_clock::now() + kLookEvery);
    std::this_thread::sleep_for(kRest);
  }
}

/// A range for the worker to compute; where others have them all, one that is done; nothing while they are at work.
std::optional<RangeReply> PartDesk::find_next() {
  const auto parts = place_.store.parts(claim_.ref.job_id);
  if (!parts) return std::nullopt;
  // By the whole order: what should be forgotten may be there still, and have the same numbers.
  std::map<std::string_view, const PartState*> of_order;
  for (const PartState& part : *parts) {
    if (part.maker == maker_) of_order.emplace(part.order, &part);
  }
  const PartState* done = nullptr;
  LoopRange made;
  for (const LoopRange& range : open_) {
    const auto found = of_order.find(part_json({range, checkpoint_}));
    const PartState* part = found == of_order.end() ? nullptr : found->second;
    if (part == nullptr || part->state == JobState::failed || part->state == JobState::canceled)
      return RangeReply{range, ""};  // nobody will
    if (part->state == JobState::queued && hold(part->id)) return RangeReply{range, ""};
    if (part->state != JobState::succeeded || done != nullptr) continue;
    done = part;
    made = range;
  }
  if (done == nullptr) return std::nullopt;
  return fetch(*done, made);
}

bool PartDesk::hold(const std::string& part) {
  auto claim = place_.store.claim_part(part, place_.options.lease);
  if (!claim || !*claim) return false;
  held_ = std::move(**claim);
  beaten_ = std::chrono::steady_clock::now();
  return true;
}

RangeReply PartDesk::fetch(const PartState& part, const LoopRange& range) {
  const std::string file = "ranges/" + std::to_string(fetched_++);
  last_fetched_ = folder_ / file;
  if (!place_.blobs.place(part.sha256, last_fetched_)) return {range, ""};
  return {range, file};
}

/// Never waits: only a worker that does not read its answers leaves no room for one.
void PartDesk::send(const RangeReply& reply) {
  const std::string text = reply_json(reply);
  static_cast<void>(::send(ends_[1], text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT));
  if (!reply.file.empty()) std::erase(open_, reply.range);
}

/// What the worker made itself is kept for its successor, should it need one.
void PartDesk::keep(const WorkerMade& made) {
  std::erase(open_, made.range);
  if (const auto held = std::exchange(held_, std::nullopt)) {
    if (const auto stored = store_made(made, held->ref); !stored)
      static_cast<void>(place_.store.fail(held->ref, {stored.error(), 500}));  // else somebody would compute it again
  }
  if (!is_artifact_name(made.file)) return;
  std::error_code none;
  std::filesystem::remove(folder_ / "out" / made.file, none);  // what was not stored only takes room
}

Result<void> PartDesk::store_made(const WorkerMade& made, const ClaimRef& part) {
  if (!is_artifact_name(made.file)) return fault("io_failed", "the range could not be written");
  KILN_TRY(gate, place_.store.enter_blob_gate());
  const std::array files{folder_ / "out" / made.file};
  KILN_TRY(stored, place_.blobs.adopt(files));
  const std::array artifacts{
      Artifact{"range", "application/octet-stream", stored.front().sha256, stored.front().bytes}};
  KILN_TRY(wrote, place_.store.commit(part, artifacts, false));
  static_cast<void>(wrote);
  return {};
}

}  // namespace kiln
