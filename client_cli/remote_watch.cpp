// Following a job to its end.
#include <algorithm>
#include <chrono>

#include "client_cli/remote.h"

namespace kiln {
namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kPatience = std::chrono::seconds(60);  // without a word from the server
constexpr double kFirstPauseS = 0.2, kLongestPauseS = 5;

/// What one connection learned.
struct Following {
  SseParser parser;
  bool heard = false;
  bool finished = false;
};

Outcome<void> follow_once(ServerLink& link, const std::string& path, Following& following,
                          const std::function<void(const ServerEvent&)>& on_event) {
  HttpHeaders headers{{"Accept", "text/event-stream"}};
  if (!following.parser.last_id().empty()) headers.emplace_back("Last-Event-ID", following.parser.last_id());
  following.parser.reset();
  return link.stream(path + "/events", headers, [&](std::string_view bytes) {
    following.heard = true;
    return following.parser.feed(bytes, [&](const ServerEvent& event) {
      on_event(event);
      following.finished = event.type == "done";
      return !following.finished;
    });
  });
}

}  // namespace

Outcome<std::string> job_path(const std::string& id) {
  const bool plain = !id.empty() && std::all_of(id.begin(), id.end(), [](unsigned char c) {
    return std::isalnum(c) || c == '-' || c == '_';
  });
  if (!plain) return fail(ExitCode::not_found, "not_found", "is no job id", id);
  return "/v1/jobs/" + id;
}

ExitCode exit_of(const JobReply& job) {
  if (job.status == "failed") return ExitCode::job_failed;
  if (job.status == "canceled") return ExitCode::canceled;
  return ExitCode::ok;
}

Outcome<JobReply> fetch_job(ServerLink& link, const std::string& id) {
  KILN_TRY(path, job_path(id));
  KILN_TRY(reply, link.get(path));
  return or_failure(parse_job(reply.body));
}

Outcome<JobReply> watch_job(ServerLink& link, const std::string& id,
                            const std::function<void(const ServerEvent&)>& on_event) {
  KILN_TRY(path, job_path(id));
  Following following;
  auto last_heard = Clock::now();
  double pause = kFirstPauseS;
  for (;;) {
    following.heard = false;
    const Outcome<void> followed = follow_once(link, path, following, on_event);
    if (following.heard) {
      last_heard = Clock::now();
      pause = kFirstPauseS;
    }
    if (!followed && followed.error().exit != ExitCode::unreachable) return tl::make_unexpected(followed.error());
    if (followed) {
      KILN_TRY(job, fetch_job(link, id));
      if (following.finished || is_terminal(job)) return job;
    } else if (Clock::now() - last_heard > kPatience) {
      return tl::make_unexpected(followed.error());
    } else if (!following.heard && pause == kFirstPauseS) {
      say("lost the server; trying again for a minute");
    }
    if (!sleep_unless_interrupted(pause, link.session().interrupt)) return interrupted();
    pause = std::min(pause * 2, kLongestPauseS);
  }
}

}  // namespace kiln
