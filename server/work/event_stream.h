#pragma once
// One reader's way through the events: replay from the store, then live.

#include <deque>

#include "server/work/event_bus.h"
#include "server/work/service.h"

namespace kiln {

/// Holds a position, not a queue: a slow reader costs no memory and still misses no durable event. Bus and store
/// outlive it.
class StoredEventStream final : public EventStream {
 public:
  StoredEventStream(JobStore& store, EventBus& bus, std::string job_id, std::uint64_t after)
      : store_(&store), bus_(&bus), job_id_(std::move(job_id)), after_(after) {}
  std::optional<JobEvent> next(Millis timeout) override;
  bool closed() const override { return bus_->closed(); }

 private:
  std::optional<JobEvent> take_ready();

  JobStore* store_;
  EventBus* bus_;
  std::string job_id_;
  std::uint64_t after_;         // id of the newest durable event in ready_ or handed out
  std::uint64_t progress_ = 0;  // number of the newest progress handed out
  std::deque<JobEvent> ready_;
};

}  // namespace kiln
