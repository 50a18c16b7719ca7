#pragma once
// Tells receivers when a job ended. At least once, signed, with the message waiting in the job store meanwhile.

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "server/jobs/delivery.h"
#include "server/webhooks/receivers.h"

namespace kiln {

struct WebhookOptions {
  std::vector<WebhookReceiver> receivers;  // none: nothing is sent and nothing kept
  bool private_too = false;                // receivers may be in this machine's own network
  Millis timeout{15'000};                  // of one try
  Millis first_pause{5'000};               // after the first that failed; three times longer each time, at most an hour
  Millis longest{24 * 3600 * 1000};        // then a message is given up
  Millis look_every{2'000};
};

/// Messages since start. A fleet's are the sum over its servers.
struct WebhookCounts {
  std::uint64_t delivered = 0;  // answered with 2xx
  std::uint64_t failed = 0;     // given up, or refused for good (410)
  std::uint64_t retried = 0;    // tries that failed and come again
};

/// The message of an ended job: {"type": "job.succeeded", "timestamp", "data": {...}}. `job` is gone when it was
/// removed meanwhile.
std::string webhook_message(const JobEvent& done, const std::optional<Job>& job);

/// The pause after so many failed tries; `chance` in [0, 1) spreads it by a quarter up and down.
Millis webhook_pause(const WebhookOptions&, int attempt, double chance);

/// One thread looks for jobs that ended; one for each receiver delivers, so that one that hangs holds up nobody else.
/// In a fleet any number of servers do so at once.
class Webhooks {
 public:
  Webhooks(JobStore& store, WebhookOptions options) : store_(store), options_(std::move(options)) {}
  ~Webhooks() { stop(); }
  void start();
  /// Tries that are under way are cut off, and due again at once.
  void stop();
  WebhookCounts counts() const { return {delivered_, failed_, retried_}; }

 private:
  void look();
  Result<bool> plan();
  void deliver(const WebhookReceiver&);
  Result<bool> deliver_one(const WebhookReceiver&);
  template <class Round>
  void repeat(Round&& round);

  JobStore& store_;
  const WebhookOptions options_;
  std::string identity_;  // of the store
  std::mutex mutex_;
  std::condition_variable changed_;
  std::atomic<bool> stopping_{false};
  std::atomic<std::uint64_t> delivered_{0}, failed_{0}, retried_{0};
  std::vector<std::thread> threads_;
};

}  // namespace kiln
