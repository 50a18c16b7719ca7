// Server-sent events: order, ids, replay, end.

#include <gtest/gtest.h>

#include "server/http/sse.h"
#include "tests/server/http/raw_client.h"

namespace kiln {
namespace {

using namespace std::chrono_literals;

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t found = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++found;
  return found;
}

TEST(Events, OfAJobComeInOrderAndEndWithIt) {
  RunningServer server;
  const std::string id = server.make_job();
  RawConnection stream(server.port());
  stream.send(request_text("GET", "/v1/jobs/" + id + "/events"));
  stream.read_until("event: state");
  server.service().say(id, EventKind::progress);
  server.service().say(id, EventKind::log, "two\nlines");
  server.service().succeed(id, {{"scene.glb", "x"}});
  const RawReply reply = stream.read_reply(10s);
  EXPECT_TRUE(reply.ended);
  EXPECT_EQ(reply.fields.at("content-type"), "text/event-stream");
  const std::size_t state = reply.body.find("event: state\ndata: {");
  const std::size_t progress = reply.body.find("event: progress\ndata: {");
  const std::size_t log = reply.body.find("event: log\ndata: {");
  const std::size_t done = reply.body.find("event: done\ndata: {");
  EXPECT_LT(state, progress);
  EXPECT_LT(progress, log);
  EXPECT_LT(log, done);
  EXPECT_NE(reply.body.find("\"status\":\"succeeded\"", done), std::string::npos);
  EXPECT_NE(reply.body.find("\"line\":\"two\\nlines\""), std::string::npos);
}

TEST(Events, AreReplayedAfterTheLastOneSeen) {
  RunningServer server;
  const std::string id = server.make_job();
  for (int i = 0; i < 3; ++i) server.service().say(id, EventKind::log, "line " + std::to_string(i));
  server.service().succeed(id, {});
  const RawReply all = server.get("/v1/jobs/" + id + "/events");
  EXPECT_EQ(count(all.body, "event: log"), 3U);
  const RawReply rest = server.get("/v1/jobs/" + id + "/events", {"Last-Event-ID: 3"});
  EXPECT_EQ(count(rest.body, "event: log"), 1U);
  EXPECT_NE(rest.body.find("id: 4\nevent: log"), std::string::npos);
  EXPECT_EQ(count(rest.body, "event: done"), 1U);
}

TEST(Events, AClientThatHasSeenTheEndIsToldNotToComeBack) {
  RunningServer server;
  const std::string id = server.make_job();
  server.service().succeed(id, {});
  EXPECT_EQ(server.get("/v1/jobs/" + id + "/events", {"Last-Event-ID: 2"}).status, 204);
}

TEST(Events, ResultsAreNotShownBeforeTheEnd) {
  RunningServer server;
  const std::string id = server.make_job();
  server.service().succeed(id, {{"scene.glb", "x"}});
  const RawReply reply = server.get("/v1/jobs/" + id + "/events");
  const std::size_t done = reply.body.find("event: done");
  EXPECT_EQ(reply.body.substr(0, done).find("scene.glb"), std::string::npos);
  EXPECT_NE(reply.body.find("scene.glb", done), std::string::npos);
}

TEST(Events, OfAllJobsBeginNow) {
  RunningServer server;
  server.make_job();
  RawConnection stream(server.port());
  stream.send(request_text("GET", "/v1/events"));
  stream.read_until("retry: 2000");
  const std::string id = server.make_job();
  const std::string& text = stream.read_until("\"id\":\"" + id + "\"");
  EXPECT_EQ(count(text, "event: state"), 1U);
}

TEST(Events, StreamsAreCappedAndFreedWhenTheirClientGoes) {
  HttpOptions options = few_threads();
  options.max_streams = 1;
  RunningServer server(options);
  {
    RawConnection first(server.port());
    first.send(request_text("GET", "/v1/events"));
    first.read_until("retry: 2000");
    const RawReply second = server.get("/v1/events");
    EXPECT_EQ(second.status, 503);
    EXPECT_EQ(second.fields.count("retry-after"), 1U);
    EXPECT_EQ(server.get("/healthz").status, 200);
  }
  RawConnection later(server.port());
  bool open = false;
  for (int i = 0; i < 200 && !open; ++i) {
    std::this_thread::sleep_for(20ms);
    RawConnection again(server.port());
    again.send(request_text("GET", "/v1/events"));
    open = again.read_until("\r\n\r\n").find("200 OK") != std::string::npos;
  }
  EXPECT_TRUE(open);
}

TEST(Events, TwentyStreamsDoNotSlowAHealthCheck) {
  HttpOptions options = few_threads();
  options.max_streams = 20;
  RunningServer server(options);
  std::vector<std::unique_ptr<RawConnection>> streams;
  for (int i = 0; i < 20; ++i) {
    streams.push_back(std::make_unique<RawConnection>(server.port()));
    streams.back()->send(request_text("GET", "/v1/events"));
    streams.back()->read_until("retry: 2000");
  }
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < 20; ++i) EXPECT_EQ(server.get("/healthz").status, 200);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 1s);  // 3.5 s each with the eight threads of the library
}

TEST(Events, ASilentStreamBeatsSoThatADeadClientIsNoticed) {
  HttpOptions options = few_threads();
  options.heartbeat = 100ms;
  RunningServer server(options);
  RawConnection stream(server.port());
  stream.send(request_text("GET", "/v1/events"));
  EXPECT_NE(stream.read_until(": heartbeat\n\n: heartbeat\n\n").find(": heartbeat\n\n: heartbeat"), std::string::npos);
}

TEST(Events, OfAnUnknownJobAre404AndOddIdsAreRefused) {
  RunningServer server;
  EXPECT_EQ(server.get("/v1/jobs/none/events").status, 404);
  EXPECT_EQ(server.get("/v1/events", {"Last-Event-ID: x"}).status, 400);
}

TEST(SseText, PutsEachLineOfItsDataOnALineOfItsOwn) {
  EXPECT_EQ(sse_text({7, "log", "a\nb"}), "id: 7\nevent: log\ndata: a\ndata: b\n\n");
  EXPECT_EQ(sse_text({0, "progress", "{}"}), "event: progress\ndata: {}\n\n");
}

}  // namespace
}  // namespace kiln
