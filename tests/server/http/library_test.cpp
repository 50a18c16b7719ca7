// What cpp-httplib does behind our front: routes, replies, streams, exceptions; and what it is kept from doing.

#include <gtest/gtest.h>
#include <pthread.h>

#include <algorithm>

#include "server/http/httplib_server.h"
#include "server/http/parse_head.h"
#include "server/http/route_pattern.h"
#include "tests/server/http/raw_client.h"

namespace kiln {
namespace {

class Collected : public Sink {
 public:
  bool write(std::string_view bytes) override {
    text.append(bytes);
    return true;
  }
  bool client_gone() override { return false; }
  std::string text;
};

Handlers handlers_of_all() {
  Handlers handlers;
  for (const Endpoint& endpoint : endpoints())
    handlers[std::string(endpoint.operation)] = [](Request&) { return json_reply(200, "{}"); };
  return handlers;
}

/// "/v1/jobs/x%2Fy" of "/v1/jobs/{id}"; every parameter has that value.
std::string filled(std::string_view pattern) {
  std::string path(pattern);
  for (std::size_t at = path.find('{'); at != std::string::npos; at = path.find('{'))
    path.replace(at, path.find('}') - at + 1, "x%20y");
  return path;
}

TEST(HttplibServer, HasAHandlerForEveryEndpointOrDoesNotStart) {
  EXPECT_ANY_THROW(HttplibServer({}, {}, {}));
  Handlers one_is_unknown = handlers_of_all();
  one_is_unknown.erase("getJob");
  one_is_unknown["getJobs"] = [](Request&) { return Reply{}; };
  EXPECT_ANY_THROW(HttplibServer(one_is_unknown, {}, {}));
}

TEST(HttplibServer, LeadsEveryMethodAndPathOfTheTableToItsHandler) {
  const Endpoint* found = nullptr;
  std::vector<std::pair<std::string, std::string>> params;
  const HttplibServer server(handlers_of_all(), {},
                             [&](const Endpoint* endpoint, const Handler& handler, Request& request) {
                               found = endpoint;
                               params = request.path_params;
                               return handler(request);
                             });
  for (const Endpoint& endpoint : endpoints())
    for (const std::string_view method : {endpoint.method, std::string_view("HEAD"), std::string_view("PATCH")}) {
      SCOPED_TRACE(std::string(method) + " " + std::string(endpoint.path));
      auto head = parse_head(std::string(method) + " " + filled(endpoint.path) + "?a=b?c HTTP/1.1\r\nHost: h\r\n\r\n");
      ASSERT_TRUE(head.has_value());
      Collected client;
      Request request;
      request.head = *head;
      request.client = &client;
      found = nullptr;
      const Outcome outcome = server.serve(request);
      const bool answers = method == endpoint.method || (method == "HEAD" && endpoint.method == "GET");
      const bool another = allowed_methods(endpoint.path).find(method) != std::string::npos;
      if (!answers && another) continue;
      EXPECT_EQ(outcome.status, answers ? 200 : 405) << client.text;
      EXPECT_EQ(found, answers ? &endpoint : nullptr);
      EXPECT_EQ(outcome.operation, answers ? endpoint.operation : "none");
      for (const auto& [name, value] : params) EXPECT_EQ(value, "x y") << name;
      EXPECT_EQ(params.size(), static_cast<std::size_t>(std::ranges::count(endpoint.path, '{')));
    }
}

/// The outcome and the bytes of GET /healthz, answered by `handler`.
struct Answered {
  Outcome outcome;
  RawReply reply;
};
Answered answered(const Handler& handler, const std::string& method = "GET") {
  const HttplibServer server(handlers_of_all(), {},
                             [&](const Endpoint*, const Handler&, Request& request) { return handler(request); });
  Collected client;
  Request request;
  request.head = *parse_head(method + " /healthz HTTP/1.1\r\nHost: h\r\n\r\n");
  request.id = "r-1";
  request.client = &client;
  const Outcome outcome = server.serve(request);
  return {outcome, parse_reply(client.text)};
}

Reply streamed(std::uint64_t length, const std::string& pieces) {
  Reply reply;
  reply.fields.push_back({"content-type", "text/x"});
  reply.stream_length = length;
  reply.stream = [pieces](Sink& sink) {
    for (const char c : pieces) sink.write({&c, 1});
  };
  return reply;
}

std::size_t lines_of(const RawReply& reply, const std::string& name) {
  std::string head = reply.head;
  std::ranges::transform(head, head.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  std::size_t found = 0;
  for (std::size_t at = head.find("\n" + name + ":"); at != std::string::npos;
       at = head.find("\n" + name + ":", at + 1))
    ++found;
  return found;
}

TEST(HttplibServer, WritesEachFieldOnceAndNoneOfItsOwnButLengthAndClose) {
  const RawReply reply = answered([](Request&) { return json_reply(200, "{}"); }).reply;
  EXPECT_EQ(reply.body, "{}");
  for (const char* name :
       {"content-type", "cache-control", "content-length", "connection", "x-content-type-options", "referrer-policy",
        "cross-origin-resource-policy", "content-security-policy", "x-request-id"})
    EXPECT_EQ(lines_of(reply, name), 1U) << name;
  EXPECT_EQ(reply.fields.size(), 9U) << reply.head;
  EXPECT_EQ(reply.fields.at("connection"), "close");
  EXPECT_EQ(reply.fields.at("content-length"), "2");
}

TEST(HttplibServer, AReplyWithoutBodyHasNoLengthAndHeadHasThatOfGet) {
  for (const int status : {204, 304}) {
    const RawReply empty = answered([&](Request&) {
                             Reply reply;
                             reply.status = status;
                             return reply;
                           }).reply;
    EXPECT_EQ(empty.status, status);
    EXPECT_EQ(lines_of(empty, "content-length"), 0U) << empty.head;
    EXPECT_EQ(lines_of(empty, "content-type"), 0U) << empty.head;
  }
  const RawReply head = answered([](Request&) { return json_reply(200, "{}"); }, "HEAD").reply;
  EXPECT_EQ(head.fields.at("content-length"), "2");
  EXPECT_EQ(head.body, "");
  EXPECT_EQ(lines_of(head, "accept-ranges"), 0U);  // the library would promise them
  const RawReply stream = answered([](Request&) { return streamed(3, "abc"); }, "HEAD").reply;
  EXPECT_EQ(stream.fields.at("content-length"), "3");
  EXPECT_EQ(stream.body, "");
}

TEST(HttplibServer, AStreamHasItsLengthOrEndsTheConnection) {
  const Answered whole = answered([](Request&) { return streamed(3, "abc"); });
  EXPECT_EQ(whole.reply.body, "abc");
  EXPECT_EQ(lines_of(whole.reply, "content-type"), 1U);
  const Answered cut = answered([](Request&) { return streamed(5, "abc"); });  // what was read of a broken file
  EXPECT_EQ(cut.reply.fields.at("content-length"), "5");
  EXPECT_EQ(cut.reply.body, "abc");
  const Answered none = answered([](Request&) { return streamed(0, ""); });
  EXPECT_EQ(none.reply.fields.at("content-length"), "0");
  EXPECT_EQ(none.reply.fields.at("content-type"), "text/x");
}

TEST(HttplibServer, H13WhatIsThrownReachesTheLogAndNotTheClient) {
  const Answered early = answered([](Request&) -> Reply { throw std::runtime_error("secret"); });
  EXPECT_EQ(early.reply.status, 500);
  EXPECT_EQ(early.outcome.fault, "secret");
  EXPECT_EQ(early.reply.all.find("secret"), std::string::npos);
  EXPECT_EQ(lines_of(early.reply, "exception_what"), 0U);
  EXPECT_EQ(answered([](Request&) -> Reply { throw 7; }).reply.status, 500);
  const Answered late = answered([](Request&) {
    Reply reply = streamed(9, "");
    reply.stream = [](Sink& sink) {
      sink.write("abc");
      throw std::runtime_error("secret");
    };
    return reply;
  });
  EXPECT_EQ(late.reply.status, 200);
  EXPECT_EQ(late.reply.body, "abc");  // six bytes short: the client knows
  EXPECT_EQ(late.outcome.fault, "secret");
}

TEST(HttplibServer, ActsOnNoFieldOfTheClient) {
  RunningServer server;
  const RawReply plain = server.get("/v1/presets");
  std::string ranges = "Range: bytes=0-";
  while (ranges.size() < 30'000) ranges += ",0-";
  for (const std::string& line :
       {std::string("Range: bytes=2-3"), std::string("Range: bytes=9-1"), std::string("Range: lines=x"), ranges,
        std::string("Accept-Encoding: br, gzip"), std::string("Connection: keep-alive"),
        std::string("Content-Encoding: gzip"), std::string("Content-Type: multipart/form-data; boundary="),
        std::string("Expect: 100-continue"), std::string("Upgrade: h2c")}) {
    SCOPED_TRACE(line.substr(0, 60));
    const RawReply reply = server.get("/v1/presets", {line});
    EXPECT_EQ(reply.status, 200);
    EXPECT_EQ(reply.body, plain.body);
    EXPECT_TRUE(reply.ended);
    EXPECT_EQ(reply.fields.at("connection"), "close");
    EXPECT_EQ(reply.all.find("HTTP/1.1", 8), std::string::npos);
  }
}

TEST(HttplibServer, ReadsNoBodyOfItsOwnAccord) {
  RunningServer server;
  const std::string much = "Content-Length: 1000000000000";
  EXPECT_EQ(server.raw(request_text("POST", "/v1/nothing", {much})).status, 404);
  EXPECT_EQ(server.raw(request_text("DELETE", "/v1/jobs", {much})).status, 405);
  EXPECT_EQ(server.raw(request_text("DELETE", "/v1/jobs/none", {much})).status, 404);
  EXPECT_EQ(server.raw(request_text("PATCH", "/", {"Content-Length: 3", "Content-Encoding: gzip"}) + "abc").status,
            405);
}

TEST(HttplibServer, MethodsThatItDoesNotRouteAre501) {
  const RunningServer server;
  for (const char* method : {"TRACE", "CONNECT", "PRI", "BREW", "get"}) {
    const RawReply reply = server.raw(request_text(method, "/healthz"));
    EXPECT_EQ(reply.status, 501) << method;
    EXPECT_EQ(parse_problem(reply.body)->code, "not_implemented");
  }
}

/// Threads made meanwhile get the stack that `ulimit -s 1024` would give them.
class SmallStacks {
 public:
  SmallStacks() {
    pthread_getattr_default_np(&before_);
    pthread_attr_t small;
    pthread_getattr_default_np(&small);
    pthread_attr_setstacksize(&small, 1u << 20);
    pthread_setattr_default_np(&small);
    pthread_attr_destroy(&small);
  }
  ~SmallStacks() {
    pthread_setattr_default_np(&before_);
    pthread_attr_destroy(&before_);
  }
  SmallStacks(const SmallStacks&) = delete;
  SmallStacks& operator=(const SmallStacks&) = delete;

 private:
  pthread_attr_t before_{};
};

TEST(HttplibServer, H14TheLongestPathFitsTheStackOfAWorkerWhateverUlimitSays) {
  const SmallStacks small;
  const RunningServer server;
  for (const char* begin : {"/", "/v1/jobs/", "/v1/jobs/x/artifacts/"})
    EXPECT_EQ(server.get(begin + std::string(4000, 'a')).status, 404) << begin;
  EXPECT_EQ(server.get("/healthz").status, 200);
}

}  // namespace
}  // namespace kiln
