#include "server/api/job.h"

#include <array>
#include <cstdio>
#include <ctime>
#include <nlohmann/json.hpp>

namespace kiln {
namespace {

using json = nlohmann::ordered_json;  // what a person reads first comes first

std::string dump(const json& value) { return value.dump(-1, ' ', false, json::error_handler_t::replace); }

json or_null(const std::string& text) { return text.empty() ? json(nullptr) : json(text); }

json parsed(const std::string& text) {
  json value = json::parse(text, nullptr, false);
  return value.is_discarded() ? json(nullptr) : value;
}

json progress_object(const ProgressReply& progress) {
  json object = {{"stage", progress.stage},
                 {"done", progress.done},
                 {"total", progress.total},
                 {"fraction", progress.fraction},
                 {"eta_s", progress.eta_s ? json(*progress.eta_s) : json(nullptr)}};
  if (progress.error) object["error"] = *progress.error;
  return object;
}

json artifact_object(std::string_view job, const ArtifactReply& artifact) {
  return {{"name", artifact.name},
          {"bytes", artifact.bytes},
          {"sha256", artifact.sha256},
          {"media_type", artifact.media_type},
          {"url", artifact.url.empty() ? artifact_url(job, artifact.name) : artifact.url}};
}

json artifact_array(std::string_view job, const std::vector<ArtifactReply>& artifacts) {
  json array = json::array();
  for (const ArtifactReply& artifact : artifacts) array.push_back(artifact_object(job, artifact));
  return array;
}

json links_object(const std::string& id) {
  const std::string self = "/v1/jobs/" + id;
  return {{"self", self},
          {"events", self + "/events"},
          {"view", "/view/" + id},
          {"artifacts", self + "/artifacts"},
          {"bundle", self + "/bundle.tar"}};
}

json job_object(const JobReply& job) {
  return {{"id", job.id},
          {"label", job.label},
          {"status", job.status},
          {"created_at", or_null(job.created_at)},
          {"started_at", or_null(job.started_at)},
          {"finished_at", or_null(job.finished_at)},
          {"attempt", job.attempt},
          {"cached", job.cached},
          {"pinned", job.pinned},
          {"recipe", parsed(job.recipe)},
          {"progress", job.progress ? progress_object(*job.progress) : json(nullptr)},
          {"error", job.error ? parsed(problem_json(*job.error)) : json(nullptr)},
          {"artifacts", artifact_array(job.id, job.artifacts)},
          {"links", links_object(job.id)}};
}

// Reading: `at` throws json::exception on a missing or mistyped member; the public functions turn that into a Fault.

std::string text_or_empty(const json& object, const char* name) {
  const auto found = object.find(name);
  return found == object.end() || found->is_null() ? std::string() : found->get<std::string>();
}

ProgressReply read_progress(const json& object) {
  ProgressReply progress;
  progress.stage = object.at("stage").get<std::string>();
  progress.done = object.value("done", std::uint64_t{0});
  progress.total = object.value("total", std::uint64_t{0});
  progress.fraction = object.value("fraction", 0.0);
  if (object.contains("eta_s") && object["eta_s"].is_number()) progress.eta_s = object["eta_s"].get<double>();
  if (object.contains("error") && object["error"].is_number()) progress.error = object["error"].get<double>();
  return progress;
}

ArtifactReply read_artifact(const json& object) {
  return {object.at("name").get<std::string>(), object.at("bytes").get<std::uint64_t>(),
          object.at("sha256").get<std::string>(), text_or_empty(object, "media_type"), text_or_empty(object, "url")};
}

JobReply read_job(const json& object) {
  JobReply job;
  job.id = object.at("id").get<std::string>();
  job.status = object.at("status").get<std::string>();
  job.label = text_or_empty(object, "label");
  job.created_at = text_or_empty(object, "created_at");
  job.started_at = text_or_empty(object, "started_at");
  job.finished_at = text_or_empty(object, "finished_at");
  job.attempt = object.value("attempt", 0);
  job.cached = object.value("cached", false);
  job.pinned = object.value("pinned", false);
  if (object.contains("recipe")) job.recipe = dump(object["recipe"]);
  if (object.contains("progress") && object["progress"].is_object()) job.progress = read_progress(object["progress"]);
  if (object.contains("error") && object["error"].is_object()) {
    auto problem = parse_problem(dump(object["error"]));
    if (problem) job.error = std::move(*problem);
  }
  if (object.contains("artifacts"))
    for (const json& artifact : object["artifacts"]) job.artifacts.push_back(read_artifact(artifact));
  return job;
}

template <class Read>
auto read_reply(std::string_view text, Read read) -> Result<decltype(read(json()))> {
  const json object = json::parse(text, nullptr, false);
  if (!object.is_object()) return fault("bad_reply", "the server's reply is no JSON object");
  try {
    return read(object);
  } catch (const json::exception&) {
    return fault("bad_reply", "the server's reply lacks a member or has one of another type");
  }
}

}  // namespace

bool is_terminal(const JobReply& job) {
  return job.status == "succeeded" || job.status == "failed" || job.status == "canceled";
}

std::string rfc3339(std::int64_t unix_ms) {
  if (unix_ms <= 0) return {};
  const std::time_t seconds = static_cast<std::time_t>(unix_ms / 1000);
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  std::array<char, 40> text{};
  const std::size_t length = std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%S", &utc);
  std::array<char, 8> millis{};
  std::snprintf(millis.data(), millis.size(), ".%03dZ", static_cast<int>(unix_ms % 1000));
  return std::string(text.data(), length) + millis.data();
}

std::string artifact_url(std::string_view job, std::string_view name) {
  return "/v1/jobs/" + std::string(job) + "/artifacts/" + std::string(name);
}

std::string job_json(const JobReply& job) { return dump(job_object(job)); }

std::string job_list_json(const JobListReply& list) {
  json jobs = json::array();
  for (const JobReply& job : list.jobs) jobs.push_back(job_object(job));
  return dump({{"jobs", std::move(jobs)}, {"next_cursor", or_null(list.next_cursor)}});
}

std::string history_json(std::string_view job, const std::vector<EventReply>& events) {
  json list = json::array();
  for (const EventReply& event : events) {
    list.push_back({{"id", event.id},
                    {"at", event.at},
                    {"kind", event.kind},
                    {"status", event.status},
                    {"message", event.message}});
  }
  return dump({{"job", job}, {"events", std::move(list)}});
}

std::string artifact_list_json(std::string_view job, const std::vector<ArtifactReply>& artifacts) {
  return dump({{"artifacts", artifact_array(job, artifacts)}});
}

std::string progress_event_json(std::string_view job, const ProgressReply& progress) {
  json object = progress_object(progress);
  object["job"] = std::string(job);
  return dump(object);
}

std::string artifact_event_json(std::string_view job, const ArtifactReply& artifact) {
  json object = artifact_object(job, artifact);
  object["job"] = std::string(job);
  return dump(object);
}

std::string log_event_json(std::string_view job, std::string_view line) {
  return dump({{"job", std::string(job)}, {"line", std::string(line)}});
}

Result<JobReply> parse_job(std::string_view text) { return read_reply(text, read_job); }

Result<ProgressReply> parse_progress(std::string_view text) { return read_reply(text, read_progress); }

Result<JobListReply> parse_job_list(std::string_view text) {
  return read_reply(text, [](const json& object) {
    JobListReply list;
    for (const json& job : object.at("jobs")) list.jobs.push_back(read_job(job));
    list.next_cursor = text_or_empty(object, "next_cursor");
    return list;
  });
}

}  // namespace kiln
