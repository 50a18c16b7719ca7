// contract.md 3, endpoint by endpoint, against a service in memory.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "core/base/sha256.h"
#include "server/api/endpoints.h"
#include "server/api/job.h"
#include "tests/server/http/raw_client.h"

namespace kiln {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;

std::string sha_of(const std::string& text) {
  return sha256_hex({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

std::string job_document() {
  return json{{"preset", "prt"}, {"scene", {{"asset", kSha}}}, {"label", "nightly"}}.dump();
}

TEST(Jobs, ADocumentBecomesAQueuedJobWithALocation) {
  RunningServer server;
  RawReply reply = server.post("/v1/jobs", "application/json", job_document());
  ASSERT_EQ(reply.status, 202) << reply.all;
  const auto job = parse_job(reply.body);
  ASSERT_TRUE(job.has_value());
  EXPECT_EQ(job->status, "queued");
  EXPECT_EQ(job->label, "nightly");
  EXPECT_EQ(reply.fields.at("location"), "/v1/jobs/" + job->id);
  EXPECT_EQ(server.service().last_submission().scene_sha256, kSha);
}

TEST(Jobs, AllMistakesOfADocumentComeTogetherWithPointers) {
  RunningServer server;
  RawReply reply =
      server.post("/v1/jobs", "application/json", R"({"steps":[{"do":"prt","order":99}],"sede":1,"force":"yes"})");
  ASSERT_EQ(reply.status, 422);
  std::set<std::string> pointers;
  const json problem = json::parse(reply.body);
  for (const json& error : problem["errors"]) pointers.insert(error["pointer"]);
  EXPECT_TRUE(pointers.contains("/steps/0/order"));
  EXPECT_TRUE(pointers.contains("/sede"));
  EXPECT_TRUE(pointers.contains("/force"));
}

TEST(Jobs, BrokenJsonIsA400WithItsPlaceAndNoLibraryText) {
  RunningServer server;
  RawReply reply = server.post("/v1/jobs", "application/json", "{\n  \"preset\": prt}");
  ASSERT_EQ(reply.status, 400);
  EXPECT_NE(reply.body.find("line 2"), std::string::npos);
  EXPECT_EQ(reply.body.find("parse_error"), std::string::npos);
}

TEST(Jobs, ABareSceneIsUploadedByCurlWithPutOrPost) {
  RunningServer server;
  for (const char* method : {"PUT", "POST"}) {
    RawReply reply = server.raw(
        request_text(method, "/v1/jobs?preset=prt&label=a%20b&environment=1,2,3.5&name=x.glb", {}, "glTF bytes"));
    ASSERT_EQ(reply.status, 202) << reply.all;
    const Submission taken = server.service().last_submission();
    EXPECT_EQ(taken.scene_sha256, sha_of("glTF bytes"));
    EXPECT_EQ(taken.scene_name, "x.glb");
    EXPECT_EQ(taken.recipe.label, "a b");
    EXPECT_EQ(taken.recipe.environment.constant, (Vec3f{1, 2, 3.5F}));
  }
}

TEST(Jobs, ABareSceneWithoutPresetIsToldWhichThereAre) {
  RunningServer server;
  RawReply reply = server.raw(request_text("PUT", "/v1/jobs", {}, "glTF"));
  EXPECT_EQ(reply.status, 400);
  EXPECT_EQ(json::parse(reply.body)["errors"][0]["pointer"], "?preset");
  EXPECT_NE(reply.body.find("prt"), std::string::npos);
}

TEST(Jobs, ATypeThatIsNoSceneIsRefused) {
  RunningServer server;
  EXPECT_EQ(server.post("/v1/jobs?preset=prt", "application/zip", "PK").status, 415);
  EXPECT_EQ(server.post("/v1/jobs?preset=prt", "text/html", "<p>").status, 415);
}

TEST(Jobs, AFormBringsSceneResourcesAndEnvironmentInAnyOrder) {
  RunningServer server;
  const std::string form =
      "--xy\r\nContent-Disposition: form-data; name=\"scene\"; filename=\"a.gltf\"\r\nContent-Type: "
      "model/gltf+json\r\n\r\n{scene}\r\n"
      "--xy\r\nContent-Disposition: form-data; name=\"resource\"; filename=\"tex/wood one.png\"\r\n\r\nPNG\r\n--x\r\n"
      "--xy\r\nContent-Disposition: form-data; name=\"environment\"; filename=\"sky.hdr\"\r\n\r\nHDR\r\n"
      "--xy\r\nContent-Disposition: form-data; "
      "name=\"job\"\r\n\r\n{\"preset\":\"prt\",\"environment\":{\"intensity\":2}}\r\n--xy--\r\n";
  RawReply reply = server.post("/v1/jobs", "multipart/form-data; boundary=\"xy\"", form);
  ASSERT_EQ(reply.status, 202) << reply.all;
  const Submission taken = server.service().last_submission();
  EXPECT_EQ(taken.scene_name, "a.gltf");
  EXPECT_EQ(taken.scene_sha256, sha_of("{scene}"));
  ASSERT_EQ(taken.resources.size(), 1U);
  EXPECT_EQ(taken.resources[0], (NamedBlob{"tex/wood one.png", sha_of("PNG\r\n--x")}));
  EXPECT_EQ(taken.recipe.environment.name, sha_of("HDR"));
  EXPECT_EQ(taken.recipe.environment.intensity, 2);
  EXPECT_EQ(taken.environment_name, "sky.hdr");
}

TEST(Jobs, AFormWithoutSceneSaysSo) {
  RunningServer server;
  const std::string form =
      "--b\r\nContent-Disposition: form-data; name=\"job\"\r\n\r\n{\"preset\":\"prt\"}\r\n--b--\r\n";
  RawReply reply = server.post("/v1/jobs", "multipart/form-data; boundary=b", form);
  EXPECT_EQ(reply.status, 422);
  EXPECT_EQ(json::parse(reply.body)["errors"][0]["pointer"], "/scene/asset");
}

TEST(Jobs, TheSameIdempotencyKeyGivesTheFirstJob) {
  RunningServer server;
  const auto send = [&] {
    return server.raw(
        request_text("POST", "/v1/jobs", {"Content-Type: application/json", "Idempotency-Key: k1"}, job_document()));
  };
  RawReply first = send(), second = send();
  EXPECT_EQ(first.status, 202);
  EXPECT_EQ(second.status, 200);
  EXPECT_EQ(parse_job(first.body)->id, parse_job(second.body)->id);
}

TEST(Jobs, AFullQueueIs429WithRetryAfterAndAFullDiskIs507) {
  RunningServer server;
  server.service().refuse_submit({"queue_full", "the queue is full", ""});
  RawReply full = server.post("/v1/jobs", "application/json", job_document());
  EXPECT_EQ(full.status, 429);
  EXPECT_EQ(full.fields.count("retry-after"), 1U);
  server.service().refuse_submit({"disk_full", "the disk is full", ""});
  EXPECT_EQ(server.post("/v1/jobs", "application/json", job_document()).status, 507);
}

TEST(Jobs, WaitAnswersWhenTheJobIsDone) {
  RunningServer server;
  const std::string id = server.make_job();
  RawConnection waiting(server.port());
  waiting.send(request_text("GET", "/v1/jobs/" + id + "?wait=30"));
  std::this_thread::sleep_for(100ms);
  server.service().succeed(id, {{"scene.glb", "x"}});
  RawReply reply = waiting.read_reply(10s);
  EXPECT_EQ(reply.status, 200);
  EXPECT_EQ(parse_job(reply.body)->status, "succeeded");
  EXPECT_EQ(parse_job(reply.body)->artifacts.at(0).url, "/v1/jobs/" + id + "/artifacts/scene.glb");
}

TEST(Jobs, WaitEndsAfterItsSeconds) {
  RunningServer server;
  const std::string id = server.make_job();
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(parse_job(server.get("/v1/jobs/" + id + "?wait=1").body)->status, "queued");
  EXPECT_GE(std::chrono::steady_clock::now() - begin, 900ms);
  RawReply created = server.raw(
      request_text("POST", "/v1/jobs", {"Content-Type: application/json", "Prefer: wait=1"}, job_document()));
  EXPECT_EQ(created.fields.at("preference-applied"), "wait=1");
}

TEST(Jobs, TheListPagesByCursorAndFilters) {
  RunningServer server;
  for (int i = 0; i < 5; ++i) server.make_job(i % 2 == 0 ? "even" : "odd");
  std::vector<std::string> seen;
  std::string cursor;
  do {
    const auto page = parse_job_list(server.get("/v1/jobs?limit=2" + (cursor.empty() ? "" : "&cursor=" + cursor)).body);
    ASSERT_TRUE(page.has_value());
    for (const JobReply& job : page->jobs) seen.push_back(job.id);
    cursor = page->next_cursor;
  } while (!cursor.empty());
  EXPECT_EQ(seen, (std::vector<std::string>{"01JOB5", "01JOB4", "01JOB3", "01JOB2", "01JOB1"}));
  EXPECT_EQ(parse_job_list(server.get("/v1/jobs?label=odd").body)->jobs.size(), 2U);
  EXPECT_EQ(parse_job_list(server.get("/v1/jobs?status=running").body)->jobs.size(), 0U);
  RawReply bad = server.get("/v1/jobs?status=done&limit=0");
  EXPECT_EQ(bad.status, 400);
  EXPECT_EQ(json::parse(bad.body)["errors"].size(), 2U);
  EXPECT_EQ(server.get("/v1/jobs?colour=red").status, 400);
}

TEST(Jobs, CancelAndDeleteActOnceAndAreHarmlessAgain) {
  RunningServer server;
  const std::string id = server.make_job();
  const std::string cancel = request_text("POST", "/v1/jobs/" + id + "/cancel");
  EXPECT_EQ(parse_job(server.raw(cancel).body)->status, "canceled");
  EXPECT_EQ(server.raw(cancel).status, 200);
  EXPECT_EQ(server.raw(request_text("DELETE", "/v1/jobs/" + id)).status, 204);
  EXPECT_EQ(server.raw(request_text("DELETE", "/v1/jobs/" + id)).status, 404);
  EXPECT_EQ(server.get("/v1/jobs/" + id).status, 404);
}

TEST(Jobs, ArePinnedAndUnpinned) {
  RunningServer server;
  const std::string id = server.make_job();
  const auto pinned = [&](const char* method) {
    RawReply reply = server.raw(request_text(method, "/v1/jobs/" + id + "/pin", {"Content-Length: 0"}));
    EXPECT_EQ(reply.status, 200) << reply.all;
    return parse_job(reply.body)->pinned;
  };
  EXPECT_FALSE(parse_job(server.get("/v1/jobs/" + id).body)->pinned);
  EXPECT_TRUE(pinned("PUT"));
  EXPECT_TRUE(parse_job(server.get("/v1/jobs/" + id).body)->pinned);
  EXPECT_FALSE(pinned("DELETE"));
  EXPECT_EQ(server.raw(request_text("PUT", "/v1/jobs/none/pin", {"Content-Length: 0"})).status, 404);
}

TEST(Jobs, TheHistoryTellsWhatHappenedInOrder) {
  RunningServer server;
  const std::string id = server.make_job();
  server.service().say(id, EventKind::log, "a line");
  server.service().succeed(id, {{"scene.glb", "x"}});
  const json history = json::parse(server.get("/v1/jobs/" + id + "/history").body);
  EXPECT_EQ(history["job"], id);
  std::vector<std::string> kinds;
  for (const json& event : history["events"]) kinds.push_back(event["kind"]);
  ASSERT_GE(kinds.size(), 3U);
  EXPECT_EQ(kinds[0], "state");
  EXPECT_EQ(kinds[1], "log");
  EXPECT_EQ(history["events"][1]["message"], "a line");
  EXPECT_EQ(kinds.back(), "done");
  EXPECT_EQ(history["events"].back()["status"], "succeeded");
  EXPECT_EQ(server.get("/v1/jobs/none/history").status, 404);
}

TEST(Jobs, AFailedJobCarriesItsProblem) {
  RunningServer server;
  const std::string id = server.make_job();
  server.service().fail(id, {"accessor_out_of_bounds", "an index is too large", "scene.glb: /accessors/3"});
  RawReply reply = server.get("/v1/jobs/" + id);
  const auto job = parse_job(reply.body);
  ASSERT_TRUE(job->error.has_value());
  EXPECT_EQ(job->error->code, "accessor_out_of_bounds");
  EXPECT_EQ(job->error->where, "scene.glb: /accessors/3");
  EXPECT_EQ(job->error->request_id, reply.fields.at("x-request-id"));
}

TEST(Plan, TakesWhatAJobTakesAndBakesNothing) {
  RunningServer server;
  RawReply reply = server.raw(request_text("POST", "/v1/plan?preset=prt", {}, "glTF"));
  EXPECT_EQ(reply.status, 200);
  EXPECT_EQ(reply.body, R"({"plan":[]})");
  EXPECT_EQ(parse_job_list(server.get("/v1/jobs").body)->jobs.size(), 0U);
}

TEST(Assets, AreNewOnceAndKnownAfterwards) {
  RunningServer server;
  const std::string bytes(100'000, 'k');
  const std::string target = "/v1/assets/" + sha_of(bytes);
  EXPECT_EQ(server.get(target).status, 404);
  RawReply first = server.raw(request_text("PUT", target, {}, bytes));
  EXPECT_EQ(first.status, 201);
  EXPECT_EQ(json::parse(first.body)["sha256"], sha_of(bytes));
  EXPECT_EQ(server.raw(request_text("PUT", target, {}, bytes)).status, 200);
  EXPECT_EQ(server.raw(request_text("POST", "/v1/assets", {}, bytes)).status, 200);
  EXPECT_EQ(server.get(target).body, bytes);
}

TEST(Assets, WithAnotherHashAreRefusedAndNothingStays) {
  RunningServer server;
  RawReply reply = server.raw(request_text("PUT", "/v1/assets/" + kSha, {}, "abc"));
  EXPECT_EQ(reply.status, 422);
  EXPECT_EQ(parse_problem(reply.body)->code, "hash_mismatch");
  EXPECT_EQ(server.get("/v1/assets/" + kSha).status, 404);
  EXPECT_EQ(server.raw(request_text("PUT", "/v1/assets/ABC", {}, "abc")).status, 422);
}

TEST(Assets, AnInterruptedUploadGoesOnWhereItEnded) {
  RunningServer server;
  const std::string bytes = std::string(300'000, 'p') + "q";
  const std::string target = "/v1/assets/" + sha_of(bytes);
  {
    RawConnection cut(server.port());
    cut.send(request_text("PUT", target, {"Content-Length: " + std::to_string(bytes.size())}));
    cut.send(bytes.substr(0, 200'000));
    cut.shut();
    EXPECT_EQ(cut.read_reply().status, 400);
  }
  RawReply asked = server.raw(request_text("HEAD", target));
  EXPECT_EQ(asked.status, 404);
  const std::size_t offset = std::stoul(asked.fields.at("upload-offset"));
  ASSERT_EQ(offset, 200'000U);
  RawReply wrong = server.raw(request_text("PUT", target, {"Upload-Offset: 5"}, bytes.substr(5)));
  EXPECT_EQ(wrong.status, 409);
  EXPECT_EQ(wrong.fields.at("upload-offset"), "200000");
  EXPECT_EQ(server.raw(request_text("PUT", target, {"Upload-Offset: 200000"}, bytes.substr(offset))).status, 201);
  EXPECT_EQ(server.get(target).body, bytes);
}

TEST(Assets, ArePinnedAndUnpinned) {
  RunningServer server;
  const std::string asset = "/v1/assets/" + sha_of("kept");
  const auto status = [&](const char* method, const std::string& path) {
    return server.raw(request_text(method, path + "/pin", {"Content-Length: 0"})).status;
  };
  EXPECT_EQ(status("PUT", asset), 404);
  ASSERT_EQ(server.raw(request_text("PUT", asset, {}, "kept")).status, 201);
  EXPECT_EQ(status("PUT", asset), 204);
  EXPECT_EQ(status("DELETE", asset), 204);
  EXPECT_EQ(status("PUT", "/v1/assets/short"), 422);
}

TEST(Assets, MayComeInPiecesNamedByContentRange) {
  RunningServer server;
  const std::string bytes = "0123456789";
  const std::string target = "/v1/assets/" + sha_of(bytes);
  EXPECT_EQ(server.raw(request_text("PUT", target, {"Content-Range: bytes 0-3/10"}, "0123")).status, 202);
  EXPECT_EQ(server.raw(request_text("PUT", target, {"Content-Range: bytes 4-9/10"}, "456789")).status, 201);
  EXPECT_EQ(server.raw(request_text("PUT", "/v1/assets/" + kSha, {"Content-Range: bytes 4-9/10"}, "45678")).status,
            400);
}

TEST(Artifacts, AreListedAndServedWithFixedTypesAsAttachments) {
  RunningServer server;
  const std::string id = server.make_job();
  server.service().succeed(id, {{"scene.glb", "glb"}, {"x.html", "<script>"}, {"report.json", "{}"}});
  const auto list = json::parse(server.get("/v1/jobs/" + id + "/artifacts").body)["artifacts"];
  EXPECT_EQ(list.size(), 3U);
  RawReply glb = server.get("/v1/jobs/" + id + "/artifacts/scene.glb");
  EXPECT_EQ(glb.body, "glb");
  EXPECT_EQ(glb.fields.at("content-type"), "model/gltf-binary");
  EXPECT_EQ(glb.fields.at("etag"), "\"" + sha_of("glb") + "\"");
  RawReply html = server.get("/v1/jobs/" + id + "/artifacts/x.html?download=1");
  EXPECT_EQ(html.fields.at("content-type"), "application/octet-stream");
  EXPECT_EQ(html.fields.at("content-disposition"), "attachment; filename=\"" + id + "-x.html\"");
  EXPECT_EQ(server.get("/v1/jobs/" + id + "/artifacts/none").status, 404);
}

TEST(Artifacts, OfAnUnfinishedJobAreNone) {
  RunningServer server;
  const std::string id = server.make_job();
  EXPECT_EQ(json::parse(server.get("/v1/jobs/" + id + "/artifacts").body)["artifacts"].size(), 0U);
  EXPECT_EQ(server.get("/v1/jobs/" + id + "/bundle.tar").status, 409);
}

TEST(Artifacts, RangesAndConditionsFollowTheStandard) {
  RunningServer server;
  const std::string id = server.make_job();
  server.service().succeed(id, {{"scene.glb", "0123456789"}, {"empty.txt", ""}});
  const std::string target = "/v1/jobs/" + id + "/artifacts/scene.glb";
  const std::string etag = "\"" + sha_of("0123456789") + "\"";
  struct Case {
    std::vector<std::string> lines;
    int status;
    std::string body, content_range;
  };
  const std::vector<Case> cases = {
      {{}, 200, "0123456789", ""},
      {{"Range: bytes=0-3"}, 206, "0123", "bytes 0-3/10"},
      {{"Range: bytes=8-"}, 206, "89", "bytes 8-9/10"},
      {{"Range: bytes=-3"}, 206, "789", "bytes 7-9/10"},
      {{"Range: bytes=-99"}, 206, "0123456789", "bytes 0-9/10"},
      {{"Range: bytes=5-99"}, 206, "56789", "bytes 5-9/10"},
      {{"Range: bytes=0-3", "If-Range: " + etag}, 206, "0123", "bytes 0-3/10"},
      {{"Range: bytes=0-3", "If-Range: \"other\""}, 200, "0123456789", ""},
      {{"Range: bytes=0-3", "If-Range: W/" + etag}, 200, "0123456789", ""},
      {{"If-None-Match: \"a\", W/" + etag}, 304, "", ""},
      {{"If-None-Match: *"}, 304, "", ""},
      {{"If-None-Match: \"a\""}, 200, "0123456789", ""},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.lines.empty() ? "plain" : c.lines.front());
    RawReply reply = server.get(target, c.lines);
    EXPECT_EQ(reply.status, c.status);
    EXPECT_EQ(reply.body, c.body);
    EXPECT_EQ(reply.fields["content-range"], c.content_range);
  }
  for (const char* bad : {"bytes=10-", "bytes=5-3", "bytes=-0", "bytes=a-b", "bytes=0-1,2-3", "lines=0-1", "bytes=-"}) {
    SCOPED_TRACE(bad);
    RawReply reply = server.get(target, {std::string("Range: ") + bad});
    EXPECT_EQ(reply.status, 416);
    EXPECT_EQ(reply.fields.at("content-range"), "bytes */10");
  }
  RawReply head = server.raw(request_text("HEAD", target));
  EXPECT_EQ(head.status, 200);
  EXPECT_EQ(head.fields.at("content-length"), "10");
  EXPECT_EQ(head.body, "");
  EXPECT_EQ(server.get("/v1/jobs/" + id + "/artifacts/empty.txt").fields.at("content-length"), "0");
}

TEST(Artifacts, TheBundleIsATarOfAll) {
  RunningServer server;
  const std::string id = server.make_job();
  server.service().succeed(id, {{"a.txt", "hello"}, {"b.bin", std::string(1024, 'b')}});
  RawReply reply = server.get("/v1/jobs/" + id + "/bundle.tar");
  ASSERT_EQ(reply.status, 200);
  ASSERT_EQ(reply.body.size(), std::stoul(reply.fields.at("content-length")));
  ASSERT_EQ(reply.body.size(), 512U + 512 + 512 + 1024 + 1024);  // heads, padded files, two zero blocks
  EXPECT_EQ(reply.body.substr(0, 6), std::string("a.txt\0", 6));
  EXPECT_EQ(reply.body.substr(512, 5), "hello");
  EXPECT_EQ(reply.body.substr(257, 5), "ustar");
  const std::string path = server.service().folder() / "bundle.tar";
  FILE* file = fopen(path.c_str(), "w");
  fwrite(reply.body.data(), 1, reply.body.size(), file);
  fclose(file);
  EXPECT_EQ(system(("tar -tf " + path + " > /dev/null").c_str()), 0);  // another program reads it
}

TEST(Query, EveryUnknownNameIsToldAndPagesKeepTheirOwn) {
  RunningServer server;
  const auto mistakes = [](const RawReply& reply) {
    std::set<std::string> pointers;
    EXPECT_EQ(reply.status, 400) << reply.body;
    const auto problem = parse_problem(reply.body);
    for (const FieldError& error : problem->errors) pointers.insert(error.pointer);
    return pointers;
  };
  const std::set<std::string> both{"?colour", "?size"};
  for (const char* path : {"/v1/jobs", "/v1/jobs/none", "/v1/events", "/v1/presets", "/v1/jobs/none/artifacts"})
    EXPECT_EQ(mistakes(server.get(std::string(path) + "?colour=red&size=3")), both) << path;
  EXPECT_EQ(mistakes(server.raw(request_text("POST", "/v1/jobs/none/cancel?size=3&colour", {"Content-Length: 0"}))),
            both);
  EXPECT_EQ(mistakes(server.raw(request_text("PUT", "/v1/jobs?preset=prt&colour=red&size=3", {}, "glTF"))), both);
  EXPECT_EQ(mistakes(server.raw(
                request_text("POST", "/v1/jobs?preset=prt&seed=1", {"Content-Type: application/json"}, "{}"))),
            (std::set<std::string>{"?preset", "?seed"}))
      << "a document says it itself";
  EXPECT_EQ(server.get("/docs?colour=red").status, 200);
}

TEST(Documents, DescribeThemselves) {
  RunningServer server;
  const auto presets = json::parse(server.get("/v1/presets").body)["presets"];
  ASSERT_FALSE(presets.empty());
  EXPECT_TRUE(presets[0]["recipe"].is_object());
  RawReply schema = server.get("/v1/schema/recipe.json");
  EXPECT_EQ(schema.fields.at("content-type"), "application/schema+json");
  EXPECT_TRUE(json::parse(schema.body).is_object());
  EXPECT_EQ(json::parse(server.get("/v1/version").body)["api"], "v1");
  const auto openapi = json::parse(server.get("/openapi.json").body);
  for (const Endpoint& endpoint : endpoints()) EXPECT_TRUE(openapi["paths"].contains(std::string(endpoint.path)));
  EXPECT_EQ(openapi["webhooks"].size(), 3U);
}

TEST(Health, IsAliveWhileReadinessTellsEveryReason) {
  RunningServer server;
  EXPECT_EQ(server.get("/readyz").status, 200);
  server.service().not_ready("the disk is nearly full");
  server.service().not_ready("the store does not write");
  RawReply reply = server.get("/readyz");
  EXPECT_EQ(reply.status, 503);
  EXPECT_EQ(json::parse(reply.body)["reasons"].size(), 2U);
  EXPECT_EQ(server.get("/healthz").status, 200);
}

TEST(Metrics, AreReadablePrometheusText) {
  RunningServer server;
  server.get("/healthz");
  server.get("/v1/jobs/none");
  RawReply reply = server.get("/metrics");
  EXPECT_EQ(reply.fields["content-type"], "text/plain; version=0.0.4; charset=utf-8");
  for (const char* sample :
       {"kiln_http_problems_total{code=\"not_found\"} 1\n", "kiln_sandbox{lock=\"files\"} ",
        "kiln_http_request_seconds_bucket{operation=\"health\",le=\"+Inf\"} 1\n",
        "# TYPE kiln_claim_latency_seconds histogram\n", "kiln_fsync_seconds_count ", "kiln_listen_drops_total ",
        "kiln_oldest_queued_seconds ", "kiln_attempts_total ", "kiln_stale_commits_total ", "kiln_webhook_pending 0\n",
        "kiln_webhook_messages_total{outcome=\"failed\"} 0\n", "kiln_webhook_retries_total 0\n",
        "kiln_worker_deaths_total{cause=\"memory\"} "}) {
    EXPECT_NE(reply.body.find(sample), std::string::npos) << sample;
  }
  EXPECT_NE(reply.body.find("kiln_http_requests_total{operation=\"health\",status=\"200\"} 1\n"), std::string::npos);
  EXPECT_NE(reply.body.find("# TYPE kiln_jobs gauge\n"), std::string::npos);
  for (std::size_t at = 0; at < reply.body.size();) {  // every line is a comment or "name{labels} number"
    const std::size_t end = reply.body.find('\n', at);
    const std::string line = reply.body.substr(at, end - at);
    if (!line.starts_with("#")) {
      EXPECT_NO_THROW(std::stod(line.substr(line.rfind(' ') + 1))) << line;
    }
    at = end + 1;
  }
}

TEST(Routing, AWrongMethodIs405WithAllowAndAWrongPath404) {
  RunningServer server;
  RawReply wrong = server.raw(request_text("DELETE", "/v1/jobs"));
  EXPECT_EQ(wrong.status, 405);
  EXPECT_EQ(wrong.fields.at("allow"), "POST, PUT, GET, HEAD");
  EXPECT_EQ(parse_problem(wrong.body)->code, "method_not_allowed");
  EXPECT_EQ(server.raw(request_text("OPTIONS", "/v1/jobs")).status, 204);
  for (const char* path : {"/v1/nothing", "/v1/jobs/", "/v1/jobs/a/b", "/v1"}) {
    RawReply reply = server.get(path);
    EXPECT_EQ(reply.status, 404) << path;
    EXPECT_EQ(parse_problem(reply.body)->code, "not_found");
  }
}

}  // namespace
}  // namespace kiln
