#include "server/http/upload.h"

#include <algorithm>
#include <set>
#include <vector>

namespace kiln {
namespace {

constexpr std::size_t kPieceBytes = 256u << 10;

const std::set<std::string> kSceneTypes = {"",
                                           "application/octet-stream",
                                           "application/x-www-form-urlencoded",  // curl --data-binary says so
                                           "model/gltf-binary",
                                           "model/gltf+json",
                                           "model/ply",
                                           "application/ply",
                                           "text/plain"};

ReadBytes from_body(BodySource& body) {
  return [&body](std::span<std::uint8_t> out) { return body.read(out); };
}

ReadBytes from_part(MultipartReader& form) {
  return [&form](std::span<std::uint8_t> out) { return form.read(out); };
}

Submission submission_of(JobRequest request) {
  Submission submission;
  submission.scene_sha256 = request.recipe.scene_asset;
  submission.recipe = std::move(request.recipe);
  submission.force = request.force;
  return submission;
}

/// What a form has brought so far.
struct Form {
  std::optional<std::string> job;
  std::optional<NamedBlob> scene, environment;
  std::vector<NamedBlob> resources;
};

tl::unexpected<Problem> bad_part(const std::string& name, const std::string& what) {
  return refuse("malformed_multipart", "the form has a mistake; it is listed in errors",
                {{"/" + name, what, "", "job, scene, environment once each; resource any number of times"}});
}

Answer<void> take_file(std::optional<NamedBlob>& slot, const PartHead& part, MultipartReader& form, Service& service) {
  if (slot) return bad_part(part.name, "is given twice");
  auto stored = store_asset(service, {}, from_part(form));
  if (!stored) return tl::make_unexpected(stored.error());
  slot = NamedBlob{part.filename.empty() ? part.name : part.filename, stored->sha256};
  return {};
}

Answer<void> take_part(const PartHead& part, MultipartReader& form, Service& service, Form& taken) {
  if (part.name == "scene") return take_file(taken.scene, part, form, service);
  if (part.name == "environment") return take_file(taken.environment, part, form, service);
  if (part.name == "resource") {
    std::optional<NamedBlob> file;
    if (part.filename.empty()) return bad_part(part.name, "needs a file name: the URI in the glTF");
    if (auto stored = take_file(file, part, form, service); !stored) return stored;
    taken.resources.push_back(std::move(*file));
    return {};
  }
  if (part.name != "job") return bad_part(part.name, "is not known here");
  if (taken.job) return bad_part(part.name, "is given twice");
  auto text = read_part_text(form, kMaxJobDocument);
  if (!text) return tl::make_unexpected(text.error());
  taken.job = std::move(*text);
  return {};
}

Answer<Form> read_form(Request& request, Service& service) {
  auto form = MultipartReader::open(request.head, *request.body);
  if (!form) return tl::make_unexpected(form.error());
  Form taken;
  while (true) {
    auto part = form->next();
    if (!part) return tl::make_unexpected(part.error());
    if (!*part) return taken;
    if (auto done = take_part(**part, *form, service, taken); !done) return tl::make_unexpected(done.error());
  }
}

/// A job document says everything itself: what the query says beside it would have no effect.
Answer<void> refuse_query(const QueryParams& params) {
  std::vector<FieldError> errors;
  for (const auto& [name, value] : params)
    errors.push_back({"?" + name, "is for a bare scene: say it in the job", "", ""});
  if (errors.empty()) return {};
  return refuse("bad_query", "the query has mistakes; each is listed in errors", std::move(errors));
}

Answer<Submission> submission_of_form(Request& request, Service& service) {
  auto form = read_form(request, service);
  if (!form) return tl::make_unexpected(form.error());
  const JobFiles files{form->scene ? form->scene->sha256 : "", form->environment ? form->environment->sha256 : ""};
  if (!form->job && request.head.params.empty()) return bad_part("job", "is missing");
  if (form->job) {
    if (auto query = refuse_query(request.head.params); !query) return tl::make_unexpected(query.error());
  }
  auto job = form->job ? parse_job_request(*form->job, files) : parse_raw_request(request.head.params, files);
  if (!job) return tl::make_unexpected(job.error());
  Submission submission = submission_of(std::move(*job));
  if (form->scene) submission.scene_name = form->scene->name;
  if (form->environment) submission.environment_name = form->environment->name;
  submission.resources = std::move(form->resources);
  return submission;
}

Answer<Submission> submission_of_document(Request& request) {
  if (auto query = refuse_query(request.head.params); !query) return tl::make_unexpected(query.error());
  auto text = read_all(*request.body, kMaxJobDocument);
  if (!text) return tl::make_unexpected(text.error());
  auto job = parse_job_request(*text);
  if (!job) return tl::make_unexpected(job.error());
  return submission_of(std::move(*job));
}

std::string param_or(const QueryParams& params, std::string_view name, std::string fallback) {
  for (const auto& [key, value] : params)
    if (key == name && !value.empty()) return value;
  return fallback;
}

Answer<Submission> submission_of_scene(Request& request, Service& service) {
  if (!kSceneTypes.contains(media_type_of(request.head)))
    return refuse("unsupported_media_type",
                  "a job is application/json, multipart/form-data or a bare glTF, GLB or PLY");
  auto job = parse_raw_request(request.head.params);  // before the upload: a mistake should not cost a gigabyte
  if (!job) return tl::make_unexpected(job.error());
  AssetRequest asset;
  asset.expected = request.body->length();
  if (asset.expected == 0) return refuse("empty_upload", "the body is empty: send a scene");
  auto stored = store_asset(service, asset, from_body(*request.body));
  if (!stored) return tl::make_unexpected(stored.error());
  job->recipe.scene_asset = stored->sha256;
  Submission submission = submission_of(std::move(*job));
  submission.scene_name = param_or(request.head.params, "name", "scene");
  return submission;
}

}  // namespace

Answer<void> copy_bytes(const ReadBytes& read, const WriteBytes& write) {
  std::vector<std::uint8_t> piece(kPieceBytes);
  while (true) {
    auto got = read(piece);
    if (!got) return tl::make_unexpected(got.error());
    if (*got == 0) return {};
    if (auto written = write(std::span(piece).first(*got)); !written)
      return tl::make_unexpected(problem_of(written.error()));
  }
}

Answer<StoredBlob> store_asset(Service& service, const AssetRequest& asset, const ReadBytes& read) {
  auto upload = service.put_asset(asset);
  if (!upload) return tl::make_unexpected(problem_of(upload.error()));
  const auto write = [&](std::span<const std::uint8_t> bytes) { return (*upload)->write(bytes); };
  if (auto copied = copy_bytes(read, write); !copied) return tl::make_unexpected(copied.error());
  auto stored = (*upload)->finish();
  if (!stored) return tl::make_unexpected(problem_of(stored.error()));
  return *stored;
}

Answer<Submission> read_submission(Request& request, Service& service) {
  const std::string type = media_type_of(request.head);
  if (type == "multipart/form-data") return submission_of_form(request, service);
  if (type == "application/json") return submission_of_document(request);
  return submission_of_scene(request, service);
}

}  // namespace kiln
