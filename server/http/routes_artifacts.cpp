#include "server/http/reply_of.h"
#include "server/http/routes.h"
#include "server/http/serve_blob.h"
#include "server/http/tar.h"

namespace kiln {
namespace {

Reply busy() { return problem_reply(make_problem("overloaded", "too many downloads at once; try again in a moment")); }

Reply list_artifacts(RouteContext&, Request& request) {
  auto job = request.service->get(path_param(request, "id"));
  if (!job) return fault_reply(job.error());
  return json_reply(200, artifact_list_json(job->id, job_reply(*job).artifacts));
}

Reply get_artifact(RouteContext& context, Request& request) {
  auto params = take_params(request.head.params, {"download"});
  if (!params) return problem_reply(params.error());
  const std::string& id = path_param(request, "id");
  Pass pass = context.downloads.enter();
  if (!pass) return busy();
  auto open = request.service->open_artifact(id, path_param(request, "name"));
  if (!open) return fault_reply(open.error());
  BlobReply how;
  how.media_type = safe_media_type(open->artifact.name);
  how.sha256 = open->artifact.sha256;
  how.file_name = params->front() == "1" ? id + "-" + open->artifact.name : open->artifact.name;
  how.pass = std::move(pass);
  return serve_blob(request.head, std::move(open->reader), std::move(how));
}

bool send_entry(Sink& sink, const OpenArtifact& file, std::int64_t modified_s) {
  const std::uint64_t bytes = file.reader.size();
  return sink.write(tar_header({file.artifact.name, bytes, modified_s})) && send_blob(sink, file.reader, 0, bytes) &&
         sink.write(std::string(tar_padding(bytes), '\0'));
}

std::uint64_t tar_length(const std::vector<OpenArtifact>& files) {
  std::uint64_t length = kTarEnd;
  for (const OpenArtifact& file : files) length += kTarBlock + file.reader.size() + tar_padding(file.reader.size());
  return length;
}

Reply tar_reply(const Job& job, std::vector<OpenArtifact> opened, Pass pass) {
  Reply reply;
  reply.fields = {{"content-type", "application/x-tar"},
                  {"content-disposition", attachment(job.id + ".tar")},
                  {"cache-control", "private, no-cache"}};
  reply.stream_length = tar_length(opened);
  auto files = std::make_shared<std::vector<OpenArtifact>>(std::move(opened));
  reply.stream = [files, modified_s = job.finished_ms / 1000, pass = std::move(pass)](Sink& sink) {
    for (const OpenArtifact& file : *files)
      if (!send_entry(sink, file, modified_s)) return;
    sink.write(std::string(kTarEnd, '\0'));
  };
  return reply;
}

Reply get_bundle(RouteContext& context, Request& request) {
  auto job = request.service->get(path_param(request, "id"));
  if (!job) return fault_reply(job.error());
  if (job->artifacts.empty())
    return problem_reply(make_problem("no_artifacts", "this job has no files (yet): only a succeeded one has"));
  Pass pass = context.downloads.enter();
  if (!pass) return busy();
  std::vector<OpenArtifact> files;
  for (const Artifact& artifact : job->artifacts) {
    auto open = request.service->open_artifact(job->id, artifact.name);
    if (!open) return fault_reply(open.error());
    files.push_back(std::move(*open));
  }
  return tar_reply(*job, std::move(files), std::move(pass));
}

}  // namespace

Handlers artifact_routes(RouteContext& context) {
  return {{"listArtifacts", [&context](Request& request) { return list_artifacts(context, request); }},
          {"getArtifact", [&context](Request& request) { return get_artifact(context, request); }},
          {"getBundle", [&context](Request& request) { return get_bundle(context, request); }}};
}

}  // namespace kiln
