#pragma once
// Messages about jobs that still have to reach somebody (server/webhooks): kept with the jobs, so that a restart, or
// another server of the fleet, goes on with them. At least once: who takes one and dies leaves it due again.

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "server/jobs/job_store.h"

namespace kiln {

/// What a receiver is to be told. The pair of message and receiver is its name.
struct NewDelivery {
  std::string message;   // id of the message, the same for all of its receivers and all tries
  std::string receiver;  // its address
  std::string body;
};

struct Delivery {
  std::string message, receiver, body;
  int attempt = 0;  // 1 for the first
  Millis age{0};    // since it was added
};

/// How far the events of jobs have been looked through, and what time it is for the store.
struct DeliveryMark {
  std::uint64_t event = 0;
  std::int64_t now_ms = 0;
};

/// All times are the store's clock; faults are those of JobStore. Every function may be called from any thread.
class DeliveryQueue {
 public:
  virtual ~DeliveryQueue() = default;

  /// Asked for the first time, the mark is at the newest event: what was before is nobody's news.
  virtual Result<DeliveryMark> mark() = 0;
  /// Adds deliveries and moves the mark from `from` to `to`, both or neither. lost: another program moved it before.
  /// Older ones than `longest` go, tried or not: a receiver that hangs or is named no more leaves no growing heap.
  virtual Result<Wrote> add(std::uint64_t from, std::uint64_t to, std::span<const NewDelivery>, Millis longest) = 0;
  /// Of those that are due for this receiver the one that is due longest. It is due again after `lease`.
  virtual Result<std::optional<Delivery>> take(const std::string& receiver, Millis lease) = 0;
  /// Delivered, or given up.
  virtual Result<void> finish(const Delivery&) = 0;
  /// Due again after `delay`.
  virtual Result<void> retry(const Delivery&, Millis delay) = 0;
};

}  // namespace kiln
