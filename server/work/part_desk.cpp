#include "server/work/part_desk.h"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "server/work/maker.h"

namespace kiln {
namespace {

constexpr Millis kLookEvery{500};  // news of other servers may get lost: this is the truth

std::optional<LoopRange> range_of(const PartState& part) {
  const auto order = parse_part(part.order);
  return order ? std::optional(order->range) : std::nullopt;
}

/// The first bytes of a file that its writer goes on with.
Result<StoredBlob> store_copy(BlobStore& blobs, const std::filesystem::path& file, std::uint64_t bytes) {
  std::ifstream in(file, std::ios::binary);
  KILN_TRY(writer, blobs.write());
  std::vector<char> piece(1 << 20);
  for (std::uint64_t left = bytes; left > 0;) {
    const auto size = static_cast<std::streamsize>(std::min<std::uint64_t>(left, piece.size()));
    if (!in.read(piece.data(), size)) return fault("io_failed", "the journal of a bake cannot be read");
    const auto* first = reinterpret_cast<const std::uint8_t*>(piece.data());
    if (auto wrote = writer.write({first, static_cast<std::size_t>(size)}); !wrote)
      return tl::make_unexpected(wrote.error());
    left -= static_cast<std::uint64_t>(size);
  }
  return writer.finish();
}

}  // namespace

PartDesk::PartDesk(const Claim& claim, const WorkPlace& place, std::filesystem::path folder, std::string checkpoint)
    : claim_(claim), place_(place), folder_(std::move(folder)), checkpoint_(std::move(checkpoint)) {
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends_.data()) != 0) return;  // the worker will hear nothing
  bool foreign = false;
  for (const PartState& part : place_.store.parts(claim_.ref.job_id).value_or(std::vector<PartState>{})) {
    const auto order = parse_part(part.order);
    if (!order || order->checkpoint != checkpoint_) {
      foreign = true;
    } else {
      known_.push_back(order->range);
    }
  }
  if (foreign) {
    static_cast<void>(place_.store.forget_parts(claim_.ref));
    known_.clear();
  }
  open_ = known_;
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

void PartDesk::hear(const WorkerLine& line) { put({line, {}}); }

void PartDesk::pass_ended(const std::string& checkpoint) { put({std::nullopt, checkpoint}); }

void PartDesk::put(News news) {
  const std::lock_guard lock(mutex_);
  news_.push(std::move(news));
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
  if (!news.line) {
    checkpoint_ = news.checkpoint;
    static_cast<void>(place_.store.forget_parts(claim_.ref));
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
  std::erase_if(open_, [&](const LoopRange& range) { return range.loop == given.loop; });
  for (std::size_t k = 0; k + 1 < given.cuts.size(); ++k)
    open_.push_back({given.loop, given.cuts[k], given.cuts[k + 1]});
  static_cast<void>(give_away(given));  // what is not in the store is left to the worker
  place_.bus.announce();
}

Result<void> PartDesk::give_away(const WorkerShare& given) {
  KILN_TRY(gate, place_.store.enter_blob_gate());
  KILN_TRY(journal, store_copy(place_.blobs, folder_ / "out" / "journal", given.journal_bytes));
  NewParts parts{{}, maker_word(), {journal.sha256, journal.bytes}};
  for (std::size_t k = 0; k + 1 < given.cuts.size(); ++k)
    parts.orders.push_back(part_json({{given.loop, given.cuts[k], given.cuts[k + 1]}, checkpoint_}));
  KILN_TRY(added, place_.store.add_parts(claim_.ref, parts));
  static_cast<void>(added);
  return {};
}

void PartDesk::answer(std::uint64_t loop) {
  while (!stopping()) {
    const std::uint64_t seen = place_.bus.ticks();
    if (const auto reply = find_next(loop)) return send(*reply);
    place_.bus.wait(seen, std::chrono::steady_clock::now() + kLookEvery);
  }
}

/// A range for the worker to compute; where others have them all, one that is done; nothing while they are at work.
std::optional<RangeReply> PartDesk::find_next(std::uint64_t loop) {
  const auto parts = place_.store.parts(claim_.ref.job_id);
  if (!parts) return std::nullopt;
  std::optional<RangeReply> done;
  for (const LoopRange& range : open_) {
    if (range.loop != loop) continue;
    const auto part = std::ranges::find(*parts, std::optional(range), range_of);
    if (part == parts->end() || part->state == JobState::failed || part->state == JobState::canceled)
      return RangeReply{range, ""};  // nobody will
    if (part->state == JobState::queued && hold(part->id)) return RangeReply{range, ""};
    if (part->state == JobState::succeeded && !done) done = fetch(*part, range);
  }
  return done;
}

bool PartDesk::hold(const std::string& part) {
  auto claim = place_.store.claim_part(part, place_.options.lease);
  if (!claim || !*claim) return false;
  held_ = std::move(**claim);
  beaten_ = std::chrono::steady_clock::now();
  return true;
}

std::optional<RangeReply> PartDesk::fetch(const PartState& part, const LoopRange& range) {
  const std::string file = "inputs/range." + std::to_string(range.loop) + "." + std::to_string(range.first);
  if (!place_.blobs.place(part.sha256, folder_ / file)) return RangeReply{range, ""};
  return RangeReply{range, file};
}

void PartDesk::send(const RangeReply& reply) {
  const std::string text = reply_json(reply);
  static_cast<void>(::send(ends_[1], text.data(), text.size(), MSG_NOSIGNAL));
  if (!reply.file.empty()) std::erase(open_, reply.range);
}

/// What the worker made itself is kept for its successor, should it need one.
void PartDesk::keep(const WorkerMade& made) {
  std::erase(open_, made.range);
  if (!held_) return;
  const Claim claim = std::move(*held_);
  held_.reset();
  const auto gate = place_.store.enter_blob_gate();
  if (!gate || !is_artifact_name(made.file)) return;
  const std::array files{folder_ / "out" / made.file};
  const auto stored = place_.blobs.adopt(files);
  if (!stored) return;
  const std::array artifacts{
      Artifact{"range", "application/octet-stream", stored->front().sha256, stored->front().bytes}};
  static_cast<void>(place_.store.commit(claim.ref, artifacts, false));
}

}  // namespace kiln
