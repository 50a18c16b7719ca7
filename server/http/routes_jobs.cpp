#include <algorithm>
#include <chrono>

#include "server/api/header_fields.h"
#include "server/http/reply_of.h"
#include "server/http/routes.h"
#include "server/http/upload.h"

namespace kiln {
namespace {

constexpr Millis kWaitSlice{250};  // how late a wait notices that its client is gone or the server drains

Reply job_document(int status, const Job& job, const Request& request) {
  return json_reply(status, job_json(job_reply(job, request.id)));
}

Reply overloaded() {
  return problem_reply(make_problem("overloaded", "too many requests wait for jobs; try again in a moment"));
}

/// The job once it is terminal, or as it is when the time is over.
Result<Job> wait_for(RouteContext& context, Request& request, const std::string& id, int seconds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(seconds);
  while (true) {
    const auto left = std::chrono::duration_cast<Millis>(end - std::chrono::steady_clock::now());
    auto job = request.service->wait_done(id, std::clamp(left, Millis{0}, kWaitSlice));
    if (!job || is_terminal(job->state) || left <= kWaitSlice || context.draining || request.client->client_gone())
      return job;
  }
}

Reply created_reply(RouteContext& context, Request& request, const Created& created, int wait) {
  Job job = created.job;
  request.upload.reset();  // who waits for a bake does not keep others from uploading
  if (wait > 0) {
    const Pass pass = context.streams.enter();  // without one the answer simply comes at once
    if (pass)
      if (auto later = wait_for(context, request, job.id, wait)) job = std::move(*later);
  }
  Reply reply = job_document(created.existed ? 200 : 202, job, request);
  reply.fields.push_back({"location", "/v1/jobs/" + job.id});
  if (wait > 0) reply.fields.push_back({"preference-applied", "wait=" + std::to_string(wait)});
  return reply;
}

Reply create_job(RouteContext& context, Request& request) {
  const std::string key(field_of(request.head, "idempotency-key"));
  if (!key.empty() && !is_idempotency_key(key))
    return problem_reply(make_problem("bad_header", "Idempotency-Key must be 1 to 255 visible ASCII characters"));
  if (context.draining) return problem_reply(make_problem("draining", "the server is shutting down"));
  auto submission = read_submission(request, *request.service);
  if (!submission) return problem_reply(submission.error());
  submission->idempotency_key = key;
  auto created = request.service->submit(*submission);
  if (!created) return fault_reply(created.error());
  return created_reply(context, request, *created, prefer_wait(field_of(request.head, "prefer")).value_or(0));
}

Reply list_jobs(RouteContext&, Request& request) {
  auto asked = parse_list_request(request.head.params);
  if (!asked) return problem_reply(asked.error());
  JobQuery query;
  query.state = parse_job_state(asked->status);
  if (!asked->label.empty()) query.label = asked->label;
  query.limit = asked->limit;
  query.cursor = asked->cursor;
  auto page = request.service->list(query);
  if (!page) return fault_reply(page.error());
  JobListReply reply;
  for (const Job& job : page->jobs) reply.jobs.push_back(job_reply(job, request.id));
  reply.next_cursor = page->next_cursor;
  return json_reply(200, job_list_json(reply));
}

Reply get_job(RouteContext& context, Request& request) {
  auto params = take_params(request.head.params, {"wait"});
  if (!params) return problem_reply(params.error());
  Answer<int> wait = params->front().empty() ? Answer<int>(0) : parse_wait(params->front());
  if (!wait) return problem_reply(wait.error());
  const std::string& id = path_param(request, "id");
  const Pass pass = *wait > 0 ? context.streams.enter() : nullptr;
  if (*wait > 0 && !pass) return overloaded();
  auto job = *wait > 0 ? wait_for(context, request, id, *wait) : request.service->get(id);
  return job ? job_document(200, *job, request) : fault_reply(job.error());
}

Reply cancel_job(RouteContext&, Request& request) {
  auto job = request.service->cancel(path_param(request, "id"));
  return job ? job_document(200, *job, request) : fault_reply(job.error());
}

Reply delete_job(RouteContext&, Request& request) {
  auto removed = request.service->remove(path_param(request, "id"));
  if (!removed) return fault_reply(removed.error());
  Reply reply;
  reply.status = 204;
  return reply;
}

Reply pin_job(Request& request) {
  const auto job = request.service->pin(path_param(request, "id"), request.head.method == "PUT");
  return job ? job_document(200, *job, request) : fault_reply(job.error());
}

Reply job_history(Request& request) {
  const std::string& id = path_param(request, "id");
  const auto events = request.service->history(id);
  if (!events) return fault_reply(events.error());
  std::vector<EventReply> replies;
  for (const JobEvent& event : *events) replies.push_back(event_reply(event));
  return json_reply(200, history_json(id, replies));
}

}  // namespace

Handlers job_routes(RouteContext& context) {
  const auto bind = [&context](Reply (*handler)(RouteContext&, Request&)) -> Handler {
    return [&context, handler](Request& request) { return handler(context, request); };
  };
  return {{"createJob", bind(create_job)},
          {"createJobFromFile", bind(create_job)},
          {"listJobs", bind(list_jobs)},
          {"getJob", bind(get_job)},
          {"cancelJob", bind(cancel_job)},
          {"deleteJob", bind(delete_job)},
          {"jobHistory", job_history},
          {"pinJob", pin_job},
          {"unpinJob", pin_job}};
}

}  // namespace kiln
