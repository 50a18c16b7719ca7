// Requests and replies cross the wire as typed values.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "server/api/endpoints.h"
#include "server/api/header_fields.h"
#include "server/api/job.h"
#include "server/api/job_request.h"
#include "server/api/problem.h"

namespace kiln {
namespace {

using nlohmann::json;

const std::string kHash(64, 'c');

std::set<std::string> pointers(const Problem& problem) {
  std::set<std::string> all;
  for (const FieldError& error : problem.errors) all.insert(error.pointer);
  return all;
}

JobReply sample_job() {
  JobReply job;
  job.id = "01J";
  job.label = "night \"ly\" \xE2\x82\xAC";
  job.status = "running";
  job.created_at = rfc3339(1'700'000'000'123);
  job.attempt = 2;
  job.recipe = R"({"seed":3})";
  job.progress = ProgressReply{"transfer", 5, 10, 0.5, 1.25, 0.02};
  job.artifacts = {{"scene.glb", 12, kHash, "model/gltf-binary", ""}};
  job.error = make_problem("non_finite_geometry", "a position is not finite");
  return job;
}

TEST(Job, SurvivesTheRoundTripThroughJson) {
  const auto back = parse_job(job_json(sample_job()));
  ASSERT_TRUE(back.has_value());
  EXPECT_EQ(job_json(*back), job_json(sample_job()));
  EXPECT_EQ(back->label, sample_job().label);
  EXPECT_EQ(back->progress->eta_s, 1.25);
  EXPECT_EQ(back->error->status, 422);
}

TEST(Job, HasEveryMemberOfTheContractEvenWhenEmpty) {
  const json job = json::parse(job_json({}));
  for (const char* name : {"id", "label", "status", "created_at", "started_at", "finished_at", "attempt", "cached",
                           "recipe", "progress", "error", "artifacts", "links"})
    EXPECT_TRUE(job.contains(name)) << name;
  EXPECT_TRUE(job["started_at"].is_null());
  EXPECT_TRUE(job["progress"].is_null());
}

TEST(Job, IsReadStrictlyWhereItMustBeThere) {
  for (const char* bad :
       {"", "[]", "{}", R"({"id":1,"status":"queued"})", R"({"id":"a","status":"queued","attempt":"x"})"})
    EXPECT_EQ(parse_job(bad).error().code, "bad_reply") << bad;
}

TEST(Job, InvalidUtf8BecomesReadableInsteadOfAnError) {
  JobReply job;
  job.label = "a\xff";
  EXPECT_TRUE(json::parse(job_json(job)).is_object());
}

TEST(Time, IsRfc3339InUtc) {
  EXPECT_EQ(rfc3339(0), "");
  EXPECT_EQ(rfc3339(1), "1970-01-01T00:00:00.001Z");
  EXPECT_EQ(rfc3339(1'700'000'000'123), "2023-11-14T22:13:20.123Z");
}

TEST(ProblemDocument, SurvivesTheRoundTrip) {
  Problem problem = make_problem("invalid_recipe", "two mistakes",
                                 {{"/a", "is missing", "", "a number"}, {"/b", "too big", "7", "1 to 5"}});
  problem.request_id = "r-1";
  problem.where = "scene.glb: /meshes/0";
  const auto back = parse_problem(problem_json(problem));
  ASSERT_TRUE(back.has_value());
  EXPECT_EQ(problem_json(*back), problem_json(problem));
  EXPECT_EQ(back->errors.at(1).received, "7");
  const json document = json::parse(problem_json(problem));
  EXPECT_EQ(document["type"], "https://kiln.invalid/problems/invalid_recipe");
  EXPECT_EQ(document["title"], "Invalid recipe");
}

TEST(ProblemDocument, StatusFollowsTheCodeAndInputFaultsAre422) {
  EXPECT_EQ(status_of_code("not_found"), 404);
  EXPECT_EQ(status_of_code("queue_full"), 429);
  EXPECT_EQ(status_of_code("disk_full"), 507);
  EXPECT_EQ(problem_of({"accessor_out_of_bounds", "", ""}).status, 422);
}

TEST(ProblemDocument, OfAStrangerIsReadAsFarAsItGoes) {
  EXPECT_EQ(parse_problem("<html>").error().code, "not_a_problem");
  const auto odd = parse_problem(R"({"type":"about:blank","status":"x","errors":[1,{"pointer":"/a"}]})");
  ASSERT_TRUE(odd.has_value());
  EXPECT_EQ(odd->status, 0);
  EXPECT_EQ(odd->errors.size(), 1U);
}

TEST(JobDocument, APresetIsTheBaseAndItsMembersGiveWay) {
  const auto job =
      parse_job_request(json{{"preset", "prt"}, {"seed", 9}, {"scene", {{"asset", kHash}}}, {"force", true}}.dump());
  ASSERT_TRUE(job.has_value()) << problem_json(job.error());
  EXPECT_EQ(job->recipe.seed, 9U);
  EXPECT_TRUE(job->force);
  EXPECT_FALSE(job->recipe.steps.empty());
}

TEST(JobDocument, FilesStandInForAssets) {
  const auto job = parse_job_request(R"({"environment":{"rotation_deg":90}})", {kHash, std::string(64, 'e')});
  ASSERT_TRUE(job.has_value()) << problem_json(job.error());
  EXPECT_EQ(job->recipe.scene_asset, kHash);
  EXPECT_EQ(job->recipe.environment.name, std::string(64, 'e'));
  EXPECT_EQ(job->recipe.environment.rotation_deg, 90);
}

TEST(JobDocument, AllMistakesComeTogether) {
  const auto job = parse_job_request(R"({"preset":"nope","force":1,"seed":-1,"colour":2})");
  ASSERT_FALSE(job.has_value());
  EXPECT_EQ(job.error().status, 422);
  const auto all = pointers(job.error());
  for (const char* pointer : {"/preset", "/force", "/seed", "/colour"}) EXPECT_TRUE(all.contains(pointer)) << pointer;
}

TEST(JobDocument, WithoutSceneOrWithAServerSideFileIsRefused) {
  const auto job = parse_job_request(R"({"environment":{"file":"sky.hdr"}})");
  ASSERT_FALSE(job.has_value());
  EXPECT_EQ(pointers(job.error()), (std::set<std::string>{"/scene/asset", "/environment/file"}));
}

TEST(JobDocument, DeepDoubleAndBrokenJsonHaveTheirOwnCodes) {
  EXPECT_EQ(parse_job_request(std::string(200'000, '[')).error().code, "json_too_deep");
  EXPECT_EQ(parse_job_request(R"({"seed":1,"seed":2})").error().code, "duplicate_member");
  EXPECT_EQ(parse_job_request("{").error().code, "malformed_json");
  EXPECT_EQ(parse_job_request("{\"label\":\"\xff\"}").error().code, "malformed_json");
  EXPECT_EQ(parse_job_request(std::string(kMaxJobDocument + 1, ' ')).error().code, "too_large");
  EXPECT_EQ(parse_job_request("3").error().status, 422);
}

TEST(RawRequest, ReadsEnvironmentInThreeForms) {
  EXPECT_EQ(parse_raw_request({{"preset", "prt"}, {"environment", kHash}})->recipe.environment.name, kHash);
  EXPECT_EQ(parse_raw_request({{"preset", "prt"}, {"environment", "1,0.5,0"}})->recipe.environment.constant,
            (Vec3f{1, 0.5F, 0}));
  EXPECT_EQ(parse_raw_request({{"preset", "prt"}, {"environment", "overcast"}})->recipe.environment.name, "overcast");
  EXPECT_FALSE(parse_raw_request({{"preset", "prt"}, {"environment", "1,a,0"}}).has_value());
  EXPECT_FALSE(parse_raw_request({{"preset", "prt"}, {"environment", "nowhere"}}).has_value());
}

TEST(RawRequest, NamesUnknownAndRepeatedParameters) {
  const auto request = parse_raw_request({{"preset", "prt"}, {"preset", "prt"}, {"order", "4"}});
  ASSERT_FALSE(request.has_value());
  EXPECT_EQ(request.error().status, 400);
  EXPECT_EQ(pointers(request.error()), (std::set<std::string>{"?preset", "?order"}));
}

TEST(HeaderFields, WaitAndKeysAreReadStrictly) {
  EXPECT_EQ(prefer_wait("respond-async, wait=10"), 10);
  EXPECT_EQ(prefer_wait("wait=9999"), kMaxWait);
  EXPECT_EQ(prefer_wait("wait=x"), std::nullopt);
  EXPECT_EQ(parse_wait("5").value(), 5);
  EXPECT_FALSE(parse_wait("-1").has_value());
  EXPECT_TRUE(is_idempotency_key("a-1"));
  EXPECT_FALSE(is_idempotency_key("a b"));
  EXPECT_FALSE(is_idempotency_key(std::string(256, 'a')));
  EXPECT_EQ(parse_decimal("18446744073709551615"), std::nullopt);
}

TEST(HeaderFields, RangesNearTheEdges) {
  EXPECT_EQ(parse_range("bytes=0-0", 1).value(), (ByteRange{0, 0}));
  EXPECT_FALSE(parse_range("bytes=0-0", 0).has_value());
  EXPECT_EQ(parse_range("bytes=-1", 5).value(), (ByteRange{4, 4}));
  EXPECT_FALSE(parse_range("bytes=0-18446744073709551615", 5).has_value());
  EXPECT_FALSE(parse_content_range("bytes 5-3/10").has_value());
  EXPECT_EQ(parse_content_range("bytes 0-9/10")->total, 10U);
}

TEST(OpenApi, EveryReferenceResolvesAndEveryPathParameterIsDescribed) {
  const json document = json::parse(openapi_json());
  EXPECT_EQ(document["openapi"], "3.1.0");
  EXPECT_TRUE(document["security"].is_array() && document["security"][1].contains("bearer"));
  const std::function<void(const json&)> check = [&](const json& node) {
    if (node.is_object() && node.contains("$ref")) {
      const std::string target = node["$ref"];
      if (target.starts_with("#")) {
        EXPECT_TRUE(document.contains(json::json_pointer(target.substr(1)))) << target;
      }
    }
    if (node.is_structured())
      for (const json& child : node) check(child);
  };
  check(document);
  for (const Endpoint& endpoint : endpoints()) {
    const json& operation = document["paths"][std::string(endpoint.path)];
    std::set<std::string> described;
    for (const auto& [method, one] : operation.items())
      for (const json& parameter : one.value("parameters", json::array())) {
        const json& full = document[json::json_pointer(parameter["$ref"].get<std::string>().substr(1))];
        if (full["in"] == "path") described.insert("{" + full["name"].get<std::string>() + "}");
      }
    std::string path(endpoint.path);
    for (const std::string& name : described) path.replace(path.find(name), name.size(), "");
    EXPECT_EQ(path.find('{'), std::string::npos) << endpoint.path;
  }
}

TEST(OpenApi, TheQueryOfAnEndpointIsTold) {
  const auto find = [](std::string_view operation) {
    return *std::ranges::find(endpoints(), operation, &Endpoint::operation);
  };
  EXPECT_EQ(query_names(find("listJobs")), (std::vector<std::string>{"status", "label", "limit", "cursor"}));
  EXPECT_EQ(query_names(find("getJob")), std::vector<std::string>{"wait"});
  const auto raw = query_names(find("createJob"));
  EXPECT_EQ(std::ranges::count(raw, "name"), 1) << "of the scene: another parameter of that name is in the path";
  EXPECT_TRUE(query_names(find("getBundle")).empty());
}

TEST(OpenApi, OperationsAreUnique) {
  std::set<std::string_view> names;
  for (const Endpoint& endpoint : endpoints())
    EXPECT_TRUE(names.insert(endpoint.operation).second) << endpoint.operation;
}

}  // namespace
}  // namespace kiln
