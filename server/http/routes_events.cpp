#include <chrono>

#include "server/api/header_fields.h"
#include "server/http/reply_of.h"
#include "server/http/routes.h"
#include "server/http/sse.h"

namespace kiln {
namespace {

using Clock = std::chrono::steady_clock;

constexpr Millis kSlice{250};  // how late a stream notices that its client is gone

/// The job as it was right after the event: its state is the event's, and results appear with the end only.
std::string job_at_event(Service& service, const JobEvent& event, const std::string& request_id) {
  auto job = service.get(event.job_id);
  JobReply reply;
  if (job) reply = job_reply(*job, request_id);
  reply.id = event.job_id;
  reply.status = to_string(event.state);
  if (!is_terminal(event.state)) {
    reply.artifacts.clear();
    reply.error.reset();
    reply.finished_at.clear();
  }
  return job_json(reply);
}

std::string event_data(Service& service, const JobEvent& event, const std::string& request_id) {
  switch (event.kind) {
    case EventKind::progress:
      return progress_event_json(event.job_id, progress_reply(event.progress.value_or(JobProgress{})));
    case EventKind::artifact:
      return artifact_event_json(event.job_id, artifact_reply(event.artifact.value_or(Artifact{})));
    case EventKind::log:
      return log_event_json(event.job_id, event.message);
    case EventKind::state:
    case EventKind::done:
      break;
  }
  return job_at_event(service, event, request_id);
}

struct Watcher {
  std::string request_id;
  bool one_job = false;
};

/// Sends events until the client, the server or the job is done.
void send_events(RouteContext& context, EventStream& events, const Watcher& watcher, Sink& sink) {
  if (!sink.write("retry: 2000\n\n")) return;
  Clock::time_point last = Clock::now();
  while (!sink.client_gone() && !context.draining) {
    const auto event = events.next(kSlice);
    if (event) {
      const SseEvent message{event->id, std::string(to_string(event->kind)),
                             event_data(context.service, *event, watcher.request_id)};
      if (!sink.write(sse_text(message))) return;
      if (watcher.one_job && event->kind == EventKind::done) return;
      last = Clock::now();
    } else if (events.closed()) {
      return;
    } else if (Clock::now() - last >= context.heartbeat) {
      if (!sink.write(": heartbeat\n\n")) return;
      last = Clock::now();
    }
  }
}

/// The id of the last event that the client saw; absent when it names none.
Answer<std::optional<std::uint64_t>> last_seen(const Request& request) {
  const std::string_view text = field_of(request.head, "last-event-id");
  if (text.empty()) return std::optional<std::uint64_t>();
  const auto id = parse_decimal(text);
  if (!id) return refuse("bad_header", "Last-Event-ID must be the id of an event");
  return id;
}

Reply stream_reply(RouteContext& context, Pass pass, std::shared_ptr<EventStream> events, Watcher watcher) {
  Reply reply;
  reply.fields = {{"content-type", "text/event-stream"}, {"cache-control", "no-store"}, {"x-accel-buffering", "no"}};
  reply.stream = [&context, pass = std::move(pass), events = std::move(events),
                  watcher = std::move(watcher)](Sink& sink) { send_events(context, *events, watcher, sink); };
  return reply;
}

/// `id` empty: all jobs.
Reply open_stream(RouteContext& context, Request& request, const std::string& id, std::optional<std::uint64_t> after) {
  Pass pass = context.streams.enter();
  if (!pass) return problem_reply(make_problem("overloaded", "too many event streams are open; try again in a moment"));
  auto events = request.service->subscribe(id, after);
  if (!events) return fault_reply(events.error());
  return stream_reply(context, std::move(pass), std::move(*events), {request.id, !id.empty()});
}

Reply job_events(RouteContext& context, Request& request) {
  const std::string& id = path_param(request, "id");
  auto after = last_seen(request);
  if (!after) return problem_reply(after.error());
  auto job = request.service->get(id);
  if (!job) return fault_reply(job.error());
  if (is_terminal(job->state) && *after && **after >= job->version) {
    Reply over;  // 204 tells an EventSource not to come back
    over.status = 204;
    return over;
  }
  return open_stream(context, request, id, after->value_or(0));
}

Reply all_events(RouteContext& context, Request& request) {
  auto after = last_seen(request);
  if (!after) return problem_reply(after.error());
  return open_stream(context, request, {}, *after);
}

}  // namespace

Handlers event_routes(RouteContext& context) {
  return {{"jobEvents", [&context](Request& request) { return job_events(context, request); }},
          {"allEvents", [&context](Request& request) { return all_events(context, request); }}};
}

}  // namespace kiln
