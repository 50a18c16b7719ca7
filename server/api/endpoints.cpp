#include "server/api/endpoints.h"

namespace kiln {
namespace {

using Types = std::vector<std::pair<std::string_view, std::string_view>>;

Types as_json(std::string_view schema) { return {{"application/json", schema}}; }

Types job_bodies() {
  return {{"application/json", "JobDocument"},
          {"multipart/form-data", "JobForm"},
          {"model/gltf-binary", "Binary"},
          {"application/octet-stream", "Binary"}};
}

void add_jobs(std::vector<Endpoint>& all) {
  all.push_back(
      {"POST",
       "/v1/jobs",
       "createJob",
       "jobs",
       "Submit a bake: a job document, a form with files, or a bare scene with ?preset=",
       {"preset", "label", "environment", "quality", "seed", "force", "sceneName", "idempotencyKey", "prefer"},
       job_bodies(),
       202,
       as_json("Job"),
       {400, 411, 413, 415, 422, 429, 503, 507}});
  all.push_back(
      {"PUT",
       "/v1/jobs",
       "createJobFromFile",
       "jobs",
       "The same for `curl -T scene.glb`: a bare scene with ?preset=",
       {"preset", "label", "environment", "quality", "seed", "force", "sceneName", "idempotencyKey", "prefer"},
       {{"application/octet-stream", "Binary"}},
       202,
       as_json("Job"),
       {400, 411, 413, 415, 422, 429, 503, 507}});
  all.push_back({"GET",
                 "/v1/jobs",
                 "listJobs",
                 "jobs",
                 "Jobs, newest first, in pages",
                 {"status", "label", "limit", "cursor"},
                 {},
                 200,
                 as_json("JobList"),
                 {400}});
  all.push_back({"GET",
                 "/v1/jobs/{id}",
                 "getJob",
                 "jobs",
                 "One job; ?wait=N answers as soon as it is done, or after N s",
                 {"id", "wait"},
                 {},
                 200,
                 as_json("Job"),
                 {400, 404, 503}});
  all.push_back({"DELETE",
                 "/v1/jobs/{id}",
                 "deleteJob",
                 "jobs",
                 "Cancel if necessary, then forget the job and its files; not a pinned one",
                 {"id"},
                 {},
                 204,
                 {},
                 {404, 409}});
  all.push_back({"PUT",
                 "/v1/jobs/{id}/pin",
                 "pinJob",
                 "jobs",
                 "Keep the job, its inputs and artefacts until it is unpinned, however old it grows",
                 {"id"},
                 {},
                 200,
                 as_json("Job"),
                 {404}});
  all.push_back({"DELETE",
                 "/v1/jobs/{id}/pin",
                 "unpinJob",
                 "jobs",
                 "Let the job go when its time is over",
                 {"id"},
                 {},
                 200,
                 as_json("Job"),
                 {404}});
  all.push_back({"POST",
                 "/v1/jobs/{id}/cancel",
                 "cancelJob",
                 "jobs",
                 "Cancel; a finished job stays as it is",
                 {"id"},
                 {},
                 200,
                 as_json("Job"),
                 {404}});
  all.push_back(
      {"GET",
       "/v1/jobs/{id}/events",
       "jobEvents",
       "jobs",
       "Server-sent events of one job: state, progress, log, artifact, done; all from its start or Last-Event-ID on",
       {"id", "lastEventId"},
       {},
       200,
       {{"text/event-stream", "EventText"}},
       {400, 404, 503}});
  all.push_back({"GET",
                 "/v1/jobs/{id}/history",
                 "jobHistory",
                 "jobs",
                 "Everything that happened to a job, oldest first: each attempt, why it ended, what came of it",
                 {"id"},
                 {},
                 200,
                 as_json("History"),
                 {404}});
  all.push_back({"GET",
                 "/v1/events",
                 "allEvents",
                 "jobs",
                 "Server-sent events of all jobs, from now or Last-Event-ID on",
                 {"lastEventId"},
                 {},
                 200,
                 {{"text/event-stream", "EventText"}},
                 {400, 503}});
}

void add_artifacts(std::vector<Endpoint>& all) {
  all.push_back({"GET",
                 "/v1/jobs/{id}/artifacts",
                 "listArtifacts",
                 "artifacts",
                 "The files of a finished job",
                 {"id"},
                 {},
                 200,
                 as_json("ArtifactList"),
                 {404}});
  all.push_back({"GET",
                 "/v1/jobs/{id}/artifacts/{name}",
                 "getArtifact",
                 "artifacts",
                 "One file: strong ETag, one Range, If-Range, If-None-Match",
                 {"id", "name", "range", "download"},
                 {},
                 200,
                 {{"application/octet-stream", "Binary"}},
                 {404, 416, 503}});
  all.push_back({"GET",
                 "/v1/jobs/{id}/bundle.tar",
                 "getBundle",
                 "artifacts",
                 "All files of a job as one tar",
                 {"id"},
                 {},
                 200,
                 {{"application/x-tar", "Binary"}},
                 {404, 409, 503}});
}

void add_assets(std::vector<Endpoint>& all) {
  all.push_back(
      {"PUT",
       "/v1/assets/{sha256}",
       "putAsset",
       "assets",
       "Upload a file under its hash: 201, or 200 when it is known. Resume with Upload-Offset or Content-Range",
       {"sha256", "uploadOffset"},
       {{"application/octet-stream", "Binary"}},
       201,
       as_json("Asset"),
       {400, 409, 411, 413, 415, 422, 503, 507}});
  all.push_back({"GET",
                 "/v1/assets/{sha256}",
                 "getAsset",
                 "assets",
                 "A file by its hash. HEAD of an unfinished upload is a 404 with Upload-Offset",
                 {"sha256", "range"},
                 {},
                 200,
                 {{"application/octet-stream", "Binary"}},
                 {404, 416, 422, 503}});
  all.push_back({"POST",
                 "/v1/assets",
                 "postAsset",
                 "assets",
                 "Upload a file; the reply tells its hash",
                 {},
                 {{"application/octet-stream", "Binary"}},
                 201,
                 as_json("Asset"),
                 {400, 411, 413, 415, 503, 507}});
}

void add_asset_pins(std::vector<Endpoint>& all) {
  all.push_back({"PUT",
                 "/v1/assets/{sha256}/pin",
                 "pinAsset",
                 "assets",
                 "Keep a file, be it an upload or an artefact, whether a job needs it or not",
                 {"sha256"},
                 {},
                 204,
                 {},
                 {404, 422}});
  all.push_back({"DELETE",
                 "/v1/assets/{sha256}/pin",
                 "unpinAsset",
                 "assets",
                 "Let a file go when no job needs it",
                 {"sha256"},
                 {},
                 204,
                 {},
                 {404, 422}});
}

void add_uploads(std::vector<Endpoint>& all) {
  all.push_back({"OPTIONS",
                 "/v1/uploads",
                 "uploadOptions",
                 "uploads",
                 "What of the tus protocol is spoken here",
                 {},
                 {},
                 204,
                 {},
                 {}});
  all.push_back({"POST",
                 "/v1/uploads",
                 "beginUpload",
                 "uploads",
                 "Begin an upload in pieces (tus 1.0). With the same sha256 in Upload-Metadata: find one again",
                 {"tusResumable", "uploadLength", "uploadMetadata"},
                 {},
                 201,
                 {},
                 {400, 412, 413, 422, 429, 503, 507}});
  all.push_back({"GET",
                 "/v1/uploads/{upload}",
                 "getUpload",
                 "uploads",
                 "Where an upload stands; HEAD tells the same by Upload-Offset and Upload-Length",
                 {"upload"},
                 {},
                 200,
                 as_json("Upload"),
                 {404, 409, 412, 503}});
  all.push_back({"PATCH",
                 "/v1/uploads/{upload}",
                 "appendUpload",
                 "uploads",
                 "The next bytes. With the last ones Upload-Asset names the asset that the file has become",
                 {"upload", "tusResumable", "pieceOffset", "uploadChecksum"},
                 {{"application/offset+octet-stream", "Binary"}},
                 204,
                 {},
                 {400, 404, 409, 411, 412, 413, 415, 422, 429, 460, 503, 507}});
  all.push_back({"DELETE",
                 "/v1/uploads/{upload}",
                 "deleteUpload",
                 "uploads",
                 "Give an upload up; an asset that it has become stays",
                 {"upload", "tusResumable"},
                 {},
                 204,
                 {},
                 {404, 409, 412}});
}

void add_recipes(std::vector<Endpoint>& all) {
  all.push_back({"POST",
                 "/v1/plan",
                 "planJob",
                 "recipes",
                 "What a bake would do and skip, and why, with predicted seconds, memory and bytes; no result is kept "
                 "(of an error target the first pass is baked for a trial)",
                 {"preset", "label", "environment", "quality", "seed", "force", "sceneName"},
                 job_bodies(),
                 200,
                 as_json("Plan"),
                 {400, 411, 413, 415, 422, 429, 503, 507}});
  all.push_back(
      {"GET", "/v1/presets", "listPresets", "recipes", "Named recipes", {}, {}, 200, as_json("PresetList"), {}});
  all.push_back({"GET",
                 "/v1/schema/recipe.json",
                 "recipeSchema",
                 "recipes",
                 "JSON Schema of a recipe",
                 {},
                 {},
                 200,
                 {{"application/schema+json", "Any"}},
                 {}});
}

void add_service(std::vector<Endpoint>& all) {
  all.push_back({"GET", "/openapi.json", "openapi", "service", "This document", {}, {}, 200, as_json("Any"), {}});
  all.push_back({"GET", "/healthz", "health", "service", "The process answers", {}, {}, 200, as_json("Any"), {}});
  all.push_back({"GET",
                 "/readyz",
                 "readiness",
                 "service",
                 "Ready for work, or 503 with every reason why not",
                 {},
                 {},
                 200,
                 as_json("Readiness"),
                 {503}});
  all.push_back(
      {"GET", "/metrics", "metrics", "service", "Prometheus metrics", {}, {}, 200, {{"text/plain", "Text"}}, {}});
  all.push_back(
      {"GET", "/v1/version", "version", "service", "Engine and API version", {}, {}, 200, as_json("Version"), {}});
}

void add_viewer(std::vector<Endpoint>& all) {
  const Types page = {{"text/html", "Text"}};
  all.push_back({"GET", "/", "galleryPage", "viewer", "Gallery of jobs", {}, {}, 200, page, {}});
  all.push_back({"GET", "/view/{id}", "viewerPage", "viewer", "Viewer of one job", {"id"}, {}, 200, page, {}});
  all.push_back({"GET", "/docs", "docsPage", "viewer", "This API, for reading", {}, {}, 200, page, {}});
  all.push_back({"GET", "/trade", "tradePage", "viewer", "What accuracy costs: measured bakes", {}, {}, 200, page, {}});
}

std::vector<Endpoint> make_endpoints() {
  std::vector<Endpoint> all;
  add_jobs(all);
  add_artifacts(all);
  add_assets(all);
  add_asset_pins(all);
  add_uploads(all);
  add_recipes(all);
  add_service(all);
  add_viewer(all);
  return all;
}

}  // namespace

const std::vector<Endpoint>& endpoints() {
  static const std::vector<Endpoint> all = make_endpoints();
  return all;
}

bool takes_body(const Endpoint& endpoint) { return !endpoint.bodies.empty(); }

}  // namespace kiln
