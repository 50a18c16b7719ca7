#include "server/webhooks/webhooks.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "server/api/job.h"
#include "server/jobs/ids.h"
#include "server/webhooks/post.h"
#include "server/webhooks/signature.h"

namespace kiln {
namespace {

constexpr int kEventsAtOnce = 500;
constexpr Millis kLongestPause{3600 * 1000};
constexpr Millis kBesidesTry{10'000};  // of a lease: a try, and time to write down its end
constexpr int kGone = 410;             // the receiver wants no more of this

/// In [0, 1).
double chance() { return static_cast<double>(std::stoul(random_token().substr(0, 8), nullptr, 16)) / 4294967296.0; }

std::int64_t now_s() {
  return std::chrono::duration_cast<std::chrono::seconds>(std::chrono::system_clock::now().time_since_epoch()).count();
}

bool hears(const WebhookReceiver& receiver, const std::optional<Job>& job) {
  return !receiver.tenant || (job && job->tenant == *receiver.tenant);
}

}  // namespace

std::string webhook_message(const JobEvent& done, const std::optional<Job>& job) {
  const std::string status(to_string(done.state));
  nlohmann::json data = {{"id", done.job_id}, {"status", status}};
  if (job) {
    data["label"] = job->label;
    data["cached"] = job->cached;
    data["attempt"] = job->attempt;
    data["created_at"] = rfc3339(job->created_ms);
    data["finished_at"] = rfc3339(job->finished_ms);
    if (!job->tenant.empty()) data["tenant"] = job->tenant;
    if (job->error) {
      const Fault& fault = job->error->fault;
      data["error"] = {{"code", fault.code}, {"detail", fault.message}, {"where", fault.where}};
    }
  }
  const nlohmann::json message = {{"type", "job." + status}, {"timestamp", rfc3339(done.at_ms)}, {"data", data}};
  return message.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

Millis webhook_pause(const WebhookOptions& options, int attempt, double chance) {
  const double plain = static_cast<double>(options.first_pause.count()) * std::pow(3.0, std::max(0, attempt - 1));
  const double longest = static_cast<double>(kLongestPause.count());
  return Millis(static_cast<std::int64_t>(std::min(plain, longest) * (0.75 + 0.5 * chance)));
}

void Webhooks::start() {
  if (options_.receivers.empty()) return;
  threads_.emplace_back([this] { look(); });
  for (const WebhookReceiver& receiver : options_.receivers) {
    threads_.emplace_back([this, &receiver] { deliver(receiver); });
  }
}

void Webhooks::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    changed_.notify_all();
  }
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
}

/// Calls `round` again at once while it had something to do, else after a while. A store that does not answer now is
/// asked again.
template <class Round>
void Webhooks::repeat(Round&& round) {
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    lock.unlock();
    const Result<bool> busy = round();
    lock.lock();
    if (busy.value_or(false)) continue;
    changed_.wait_for(lock, options_.look_every, [&] { return stopping_.load(); });
  }
}

void Webhooks::look() {
  repeat([this] { return plan(); });
}

void Webhooks::deliver(const WebhookReceiver& receiver) {
  repeat([&] { return deliver_one(receiver); });
}

/// A delivery to each receiver for each job that ended since the mark. True when there may be more.
Result<bool> Webhooks::plan() {
  if (identity_.empty()) {
    KILN_TRY(identity, store_.identity());
    identity_ = std::move(identity);
  }
  KILN_TRY(mark, store_.deliveries().mark());
  KILN_TRY(events, store_.events_after(mark.event, "", kEventsAtOnce));
  if (events.empty()) return false;
  std::vector<NewDelivery> deliveries;
  for (const JobEvent& event : events) {
    // After weeks without receivers nobody wants to hear of those weeks.
    if (event.kind != EventKind::done || event.at_ms < mark.now_ms - options_.longest.count()) continue;
    const auto found = store_.get(event.job_id);
    if (!found && found.error().code != "not_found") return tl::make_unexpected(found.error());
    const std::optional<Job> job = found ? std::optional(*found) : std::nullopt;
    const std::string message = "msg_" + identity_.substr(0, 12) + "_" + std::to_string(event.id);
    for (const WebhookReceiver& receiver : options_.receivers) {
      if (hears(receiver, job)) deliveries.push_back({message, receiver.url, webhook_message(event, job)});
    }
  }
  KILN_TRY(added, store_.deliveries().add(mark.event, events.back().id, deliveries, options_.longest));
  static_cast<void>(added);  // lost: another server did it
  return true;
}

/// False when nothing is due.
Result<bool> Webhooks::deliver_one(const WebhookReceiver& receiver) {
  DeliveryQueue& queue = store_.deliveries();
  KILN_TRY(due, queue.take(receiver.url, options_.timeout + kBesidesTry));
  if (!due) return false;
  const std::int64_t sent_s = now_s();
  WebhookPost post;
  post.url = receiver.url;
  post.body = due->body;
  post.private_too = options_.private_too;
  post.timeout = options_.timeout;
  post.stop = &stopping_;
  post.connect_timeout = std::min(post.connect_timeout, options_.timeout);
  post.fields = {"content-type: application/json",
                 "user-agent: kilnd",
                 "expect:",
                 "webhook-id: " + due->message,
                 "webhook-timestamp: " + std::to_string(sent_s),
                 "webhook-signature: " + webhook_signature(receiver.key, {due->message, sent_s, due->body})};
  const int status = post_webhook(post);
  const bool taken = status >= 200 && status < 300;
  const Millis pause = webhook_pause(options_, due->attempt, chance());
  const bool last = due->age + pause > options_.longest;
  const bool cut_off = status == 0 && stopping_;
  const bool over = taken || status == kGone || (last && !cut_off);
  const Result<void> noted = over ? queue.finish(*due) : queue.retry(*due, cut_off ? Millis(0) : pause);
  if (!noted) return tl::make_unexpected(noted.error());
  ++(taken ? delivered_ : over ? failed_ : retried_);
  return true;
}

}  // namespace kiln
