#include "server/work/event_stream.h"

namespace kiln {
namespace {

constexpr int kPage = 100;

JobEvent progress_event(const EventBus::Progress& news) {
  JobEvent event;
  event.job_id = news.job_id;
  event.kind = EventKind::progress;
  event.state = JobState::running;
  event.at_ms = std::chrono::duration_cast<Millis>(std::chrono::system_clock::now().time_since_epoch()).count();
  event.progress = news.progress;
  return event;
}

}  // namespace

std::optional<JobEvent> StoredEventStream::take_ready() {
  if (ready_.empty()) {
    if (auto events = store_->events_after(after_, job_id_, kPage); events && !events->empty()) {
      after_ = events->back().id;
      ready_.assign(events->begin(), events->end());
    }
  }
  if (!ready_.empty()) {
    JobEvent event = std::move(ready_.front());
    ready_.pop_front();
    return event;
  }
  if (const auto news = bus_->progress_after(progress_, job_id_)) {
    progress_ = news->number;
    return progress_event(*news);
  }
  return std::nullopt;
}

std::optional<JobEvent> StoredEventStream::next(Millis timeout) {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  while (true) {
    const std::uint64_t seen = bus_->ticks();
    if (auto event = take_ready()) return event;
    if (!bus_->wait(seen, deadline)) return std::nullopt;
  }
}

}  // namespace kiln
