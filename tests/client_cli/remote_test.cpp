// The built program against a server that misbehaves on purpose.
#include <gtest/gtest.h>
#include <httplib.h>

#include <atomic>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "core/base/sha256.h"
#include "tests/client_cli/run_kiln.h"

namespace kiln {
namespace {

using nlohmann::json;

constexpr const char* kId = "01JFAKE";

std::string hash_of(const std::string& text) {
  return sha256_hex({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

json job_of(const std::string& status, const std::string& artifact) {
  json job = {{"id", kId},
              {"label", ""},
              {"status", status},
              {"created_at", "2026-01-01T00:00:00Z"},
              {"started_at", nullptr},
              {"finished_at", nullptr},
              {"attempt", 1},
              {"cached", false},
              {"recipe", json::object()},
              {"progress", nullptr},
              {"error", nullptr},
              {"artifacts", json::array()},
              {"links", json::object()}};
  if (status == "succeeded") {
    job["artifacts"].push_back({{"name", "scene.glb"},
                                {"bytes", artifact.size()},
                                {"sha256", hash_of(artifact)},
                                {"media_type", "model/gltf-binary"},
                                {"url", std::string("/v1/jobs/") + kId + "/artifacts/scene.glb"}});
  }
  if (status == "failed") {
    job["error"] = {{"type", "https://kiln.invalid/problems/internal"},
                    {"title", "Internal"},
                    {"status", 500},
                    {"detail", "the worker ended by itself"}};
  }
  return job;
}

std::string event(int id, const std::string& type, const json& data) {
  return "id: " + std::to_string(id) + "\nevent: " + type + "\ndata: " + data.dump() + "\n\n";
}

/// A server that accepts one job; what it does with it is set by the test before it starts.
class Remote : public ::testing::Test {
 protected:
  std::string end = "succeeded", artifact = "the artefact's bytes";
  int busy = 0;             // 429 answers before a submission is taken
  int breaks = 0;           // event streams that end in the middle
  int bad_downloads = 0;    // downloads with a wrong byte
  bool never_ends = false;  // the stream stays open
  bool known = false;       // HEAD of an asset finds it
  std::size_t already = 0;  // bytes of the scene that an earlier upload left
  bool speaks_tus = true;   // begins uploads in pieces, and has forgotten them by the next request
  int seals_after = -1;     // or keeps them, and makes an asset of one when it was asked so often
  std::string sent_file = "plane.gltf";

  std::atomic<std::size_t> whole{0};  // bytes of an upload in pieces
  std::atomic<int> asked{0};          // how it stands
  std::atomic<int> uploads{0}, begun{0}, streams{0}, downloads{0}, cancels{0};
  std::mutex mutex;
  std::string submitted, last_event_id, token, key;
  std::map<std::string, httplib::MultipartFormData> form;

  httplib::Server server;
  std::thread thread;
  Folder folder;
  std::string url, scene = folder.write("plane.gltf", plane_gltf());

  void SetUp() override {
    server.Get(R"(/v1/assets/.*)", [this](const auto&, auto& reply) {
      reply.status = known ? 200 : 404;
      if (already > 0) reply.set_header("Upload-Offset", std::to_string(already));
    });
    server.Put(R"(/v1/assets/(.*))", [this](const httplib::Request& request, auto& reply) {
      ++uploads;
      const std::string whole = folder.read(sent_file).substr(0, already) + request.body;
      const bool placed = request.get_header_value("Upload-Offset") == std::to_string(already);
      reply.status = placed && request.matches[1] == hash_of(whole) ? 201 : 422;
    });
    server.Post("/v1/uploads", [this](const auto&, auto& reply) {
      ++begun;
      reply.status = speaks_tus ? 201 : 404;
      reply.set_header("Location", "/v1/uploads/0123");
      reply.set_header("Upload-Offset", "0");
    });
    server.Patch("/v1/uploads/0123", [this](const httplib::Request& request, auto& reply) {
      reply.status = seals_after < 0 ? 404 : 204;
      whole += request.body.size();
      reply.set_header("Upload-Offset", std::to_string(whole));
    });
    server.Get("/v1/uploads/0123", [this](const auto&, auto& reply) {
      reply.set_header("Upload-Offset", std::to_string(whole));
      if (++asked >= seals_after) reply.set_header("Upload-Asset", "its hash");
    });
    server.Post("/v1/jobs", [this](const httplib::Request& request, auto& reply) { submit(request, reply); });
    server.Get("/v1/jobs", [this](const auto&, auto& reply) {
      reply.set_content(json{{"jobs", {job_of(end, artifact)}}, {"next_cursor", nullptr}}.dump(), "application/json");
    });
    server.Get(std::string("/v1/jobs/") + kId, [this](const auto&, auto& reply) {
      const bool over = streams > breaks && !never_ends;
      reply.set_content(job_of(over ? end : "running", artifact).dump(), "application/json");
    });
    server.Post(std::string("/v1/jobs/") + kId + "/cancel", [this](const auto&, auto& reply) {
      ++cancels;
      reply.set_content(job_of("canceled", "").dump(), "application/json");
    });
    server.Delete(std::string("/v1/jobs/") + kId, [](const auto&, auto& reply) { reply.status = 204; });
    server.Get(std::string("/v1/jobs/") + kId + "/events",
               [this](const httplib::Request& request, auto& reply) { send_events(request, reply); });
    server.Get(std::string("/v1/jobs/") + kId + "/artifacts/scene.glb", [this](const auto&, auto& reply) {
      std::string bytes = artifact;
      if (++downloads <= bad_downloads) bytes[0] = static_cast<char>(bytes[0] ^ 1);
      reply.set_content(bytes, "model/gltf-binary");
    });
    const int port = server.bind_to_any_port("127.0.0.1");
    ASSERT_GT(port, 0);
    url = "http://127.0.0.1:" + std::to_string(port);
    thread = std::thread([this] { server.listen_after_bind(); });
    while (!server.is_running()) std::this_thread::yield();
  }
  void TearDown() override {
    server.stop();
    thread.join();
  }

  void submit(const httplib::Request& request, httplib::Response& reply) {
    if (busy-- > 0) {
      reply.status = 429;
      reply.set_header("Retry-After", "1");
      return;
    }
    const std::lock_guard lock(mutex);
    submitted = request.body;
    form = {request.files.begin(), request.files.end()};
    token = request.get_header_value("Authorization");
    key = request.get_header_value("Idempotency-Key");
    reply.status = 202;
    reply.set_content(job_of("queued", "").dump(), "application/json");
  }

  void send_events(const httplib::Request& request, httplib::Response& reply) {
    const int stream = ++streams;
    {
      const std::lock_guard lock(mutex);
      last_event_id = request.get_header_value("Last-Event-ID");
    }
    const bool breaks_off = stream <= breaks;
    reply.set_chunked_content_provider("text/event-stream", [=, this](std::size_t, httplib::DataSink& sink) {
      const auto send = [&](const std::string& text) { sink.write(text.data(), text.size()); };
      const json progress = {
          {"stage", "transfer"}, {"done", stream}, {"total", 10}, {"fraction", 0.1 * stream}, {"job", kId}};
      send(event(stream, "progress", progress));
      if (never_ends) {
        while (server.is_running()) {
          send(": heartbeat\n\n");
          std::this_thread::sleep_for(std::chrono::milliseconds(50));
          if (!sink.is_writable()) return false;
        }
        return false;
      }
      if (breaks_off) return false;  // in the middle of the reply
      send(event(stream + 100, "done", job_of(end, artifact)));
      sink.done();
      return true;
    });
  }

  Ran bake(const std::vector<std::string>& more = {}) {
    std::vector<std::string> words{"bake", scene, "--server", url, "-o", folder.path("out")};
    words.insert(words.end(), more.begin(), more.end());
    return run_kiln(words, {{"KILN_TOKEN", "secret-word"}});
  }
};

TEST_F(Remote, ABakeUploadsWatchesAndDownloads) {
  const Ran ran = bake({"--env", "1,2,3", "--label", "night", "--idempotency-key", "k1"});
  EXPECT_EQ(ran.exit, 0) << ran.err;
  EXPECT_EQ(folder.read("out/scene.glb"), artifact);
  EXPECT_EQ(uploads, 1);
  const json job = json::parse(submitted);
  EXPECT_EQ(job.at("scene").at("asset"), hash_of(folder.read("plane.gltf")));
  EXPECT_EQ(job.at("environment").at("constant"), json({1.0, 2.0, 3.0}));
  EXPECT_EQ(job.at("label"), "night");
  EXPECT_EQ(token, "Bearer secret-word");
  EXPECT_EQ(key, "k1");
}

TEST_F(Remote, WhatTheServerKnowsIsNotSentAgain) {
  known = true;
  EXPECT_EQ(bake().exit, 0);
  EXPECT_EQ(uploads, 0);
}

TEST_F(Remote, AnUploadGoesOnWhereItBroke) {
  already = 100;
  const Ran ran = bake();
  EXPECT_EQ(ran.exit, 0) << ran.err;
  EXPECT_EQ(uploads, 1);
}

TEST_F(Remote, WhereUploadsInPiecesAreNotKeptALargeFileIsSentWhole) {
  sent_file = "large.ply";
  scene = folder.write(sent_file, "ply\n" + std::string(17 << 20, 'x'));
  const Ran forgetful = run_kiln({"submit", scene, "--preset", "prt", "--server", url});
  EXPECT_EQ(forgetful.exit, 0) << forgetful.err;
  EXPECT_EQ(begun, 2) << "a balancer may have led to two servers";
  EXPECT_EQ(uploads, 1);
  speaks_tus = false;
  const Ran old = run_kiln({"submit", scene, "--preset", "prt", "--server", url});
  EXPECT_EQ(old.exit, 0) << old.err;
  EXPECT_EQ(uploads, 2);
}

TEST_F(Remote, AnUploadInPiecesIsOverWhenItIsAnAsset) {
  sent_file = "large.ply";
  scene = folder.write(sent_file, "ply\n" + std::string(17 << 20, 'x'));
  seals_after = 2;
  const Ran ran = run_kiln({"submit", scene, "--preset", "prt", "--server", url});
  EXPECT_EQ(ran.exit, 0) << ran.err;
  EXPECT_EQ(whole, (17U << 20) + 4) << "nothing twice";
  EXPECT_EQ(asked, 2) << "until it is one";
  EXPECT_EQ(begun, 1);
  EXPECT_EQ(ran.err.find("broke"), std::string::npos) << ran.err;
}

TEST_F(Remote, AnEnvironmentFileTravelsWithItsName) {
  const auto sky = folder.write("sky.hdr", "any bytes: the server judges them");
  folder.write("r.json", R"({"environment":{"file":"sky.hdr","rotation_deg":30}})");
  EXPECT_EQ(bake({"-r", folder.path("r.json")}).exit, 0);
  EXPECT_EQ(form.at("environment").filename, "sky.hdr");
  EXPECT_EQ(form.at("environment").content, folder.read("sky.hdr"));
  const json environment = json::parse(form.at("job").content).at("environment");
  EXPECT_EQ(environment.at("asset"), hash_of(folder.read("sky.hdr")));
  EXPECT_EQ(environment.at("rotation_deg"), 30);
  EXPECT_FALSE(environment.contains("file"));
  EXPECT_EQ(uploads, 1) << "the scene";
}

TEST_F(Remote, AGltfTravelsWithItsFiles) {
  const std::string uri = "data:application/octet-stream;base64,";
  std::string gltf = folder.read("plane.gltf");
  const auto start = gltf.find(uri), stop = gltf.find('"', start);
  gltf.replace(start, stop - start, "b%20in.bin");
  folder.write("b in.bin", std::string(100000, 'x'));
  scene = folder.write("with.gltf", gltf);
  EXPECT_EQ(bake().exit, 0);
  EXPECT_EQ(uploads, 0);
  EXPECT_EQ(form.at("scene").filename, "with.gltf");
  EXPECT_EQ(form.at("scene").content, gltf);
  EXPECT_EQ(form.at("resource").filename, "b in.bin");
  EXPECT_EQ(form.at("resource").content.size(), 100000U);
}

TEST_F(Remote, ABusyServerIsWaitedFor) {
  busy = 2;
  const Ran ran = bake();
  EXPECT_EQ(ran.exit, 0) << ran.err;
  EXPECT_NE(ran.err.find("busy"), std::string::npos);
}

TEST_F(Remote, ALostEventStreamIsTakenUpWhereItBroke) {
  breaks = 3;
  const Ran ran = bake();
  EXPECT_EQ(ran.exit, 0) << ran.err;
  EXPECT_EQ(streams, 4);
  EXPECT_EQ(last_event_id, "3");
}

TEST_F(Remote, ABrokenDownloadIsTriedAgainAndNeverKept) {
  bad_downloads = 1;
  EXPECT_EQ(bake().exit, 0);
  EXPECT_EQ(downloads, 2);
  EXPECT_EQ(folder.read("out/scene.glb"), artifact);
  bad_downloads = 100;
  const Ran ran = run_kiln({"get", kId, "--server", url, "-o", folder.path("other")});
  EXPECT_EQ(ran.exit, 1) << ran.err;
  EXPECT_EQ(folder.read("other/scene.glb"), "");
}

TEST_F(Remote, AFailedJobEndsWithThreeAndItsReason) {
  end = "failed";
  for (const Ran& ran : {bake(), run_kiln({"watch", kId, "--server", url})}) {
    EXPECT_EQ(ran.exit, 3);
    EXPECT_NE(ran.err.find("the worker ended by itself"), std::string::npos) << ran.err;
  }
}

TEST_F(Remote, ACanceledJobEndsWithFour) {
  end = "canceled";
  EXPECT_EQ(bake().exit, 4);
  EXPECT_EQ(run_kiln({"cancel", kId, "--server", url}).out, std::string(kId) + " canceled\n");
  EXPECT_EQ(cancels, 1);
}

TEST_F(Remote, CtrlCDetachesAndSaysHowToCancel) {
  never_ends = true;
  const Ran ran = run_until({"bake", scene, "--server", url, "-o", folder.path("out")}, "transfer");
  EXPECT_EQ(ran.exit, 130) << ran.err;
  EXPECT_NE(ran.err.find(std::string("kiln cancel ") + kId), std::string::npos) << ran.err;
  EXPECT_EQ(cancels, 0);
}

TEST_F(Remote, WatchWithJsonGivesALineForEachEventAndTheJobAtLast) {
  const Ran ran = run_kiln({"watch", kId, "--server", url, "--json"});
  EXPECT_EQ(ran.exit, 0) << ran.err;
  std::istringstream lines(ran.out);
  std::vector<json> all;
  for (std::string line; std::getline(lines, line);) all.push_back(json::parse(line));
  ASSERT_EQ(all.size(), 3U);
  EXPECT_EQ(all[0].at("event"), "progress");
  EXPECT_EQ(all[1].at("event"), "done");
  EXPECT_EQ(all[2].at("status"), "succeeded");
}

TEST_F(Remote, SmallCommandsSayWhatTheyDid) {
  EXPECT_EQ(run_kiln({"rm", kId, "--server", url}).out, std::string(kId) + "\n");
  EXPECT_EQ(run_kiln({"submit", scene, "--server", url}).out, std::string(kId) + "\n");
  EXPECT_EQ(run_kiln({"open", kId, "--server", url + "/"}).out, url + "/view/" + kId + "\n");
  EXPECT_NE(run_kiln({"list", "--server", url}).out.find(kId), std::string::npos);
  EXPECT_EQ(json::parse(run_kiln({"list", "--server", url, "--json"}).out).at("jobs").size(), 1U);
  EXPECT_EQ(run_kiln({"get", "01JOTHER", "--server", url}).exit, 5);
  EXPECT_EQ(run_kiln({"get", "../etc", "--server", url}).exit, 5);
}

}  // namespace
}  // namespace kiln
