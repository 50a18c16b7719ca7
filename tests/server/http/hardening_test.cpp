// reliability.md 3.1: what a stranger may throw at the port. H-numbers are those of its table.

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>

#include "server/api/problem.h"
#include "tests/server/http/raw_client.h"

namespace kiln {
namespace {

using namespace std::chrono_literals;

double resident_mb() {
  std::ifstream file("/proc/self/statm");
  long total = 0, resident = 0;
  file >> total >> resident;
  return static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

std::string problem_code(const RawReply& reply) {
  const auto problem = parse_problem(reply.body);
  return problem ? problem->code : "";
}

void expect_refusal(const RawReply& reply, int status, const std::string& code) {
  EXPECT_EQ(reply.status, status) << reply.all.substr(0, 300);
  EXPECT_EQ(problem_code(reply), code);
  EXPECT_EQ(reply.fields.at("content-type"), "application/problem+json");
  EXPECT_TRUE(reply.ended);
}

void expect_alive(const RunningServer& server) { EXPECT_EQ(server.get("/healthz").status, 200); }

TEST(Hardening, H1AnEndlessHeaderLineEndsAt32KiB) {
  const RunningServer server;
  RawConnection connection(server.port());
  connection.send("GET / HTTP/1.1\r\nX: ");
  const double before = resident_mb();
  const std::string piece(1 << 20, 'a');
  int sent = 0;
  while (sent < 200 && connection.send(piece)) ++sent;
  EXPECT_LT(sent, 200);                   // the server stopped taking it
  EXPECT_LT(resident_mb() - before, 40);  // the kernel's buffers are not ours; ours hold 32 KiB
  expect_alive(server);
}

TEST(Hardening, H1ATooLargeHeadIsToldSo) {
  const RunningServer server;
  expect_refusal(server.raw("GET / HTTP/1.1\r\nX: " + std::string(33'000, 'a') + "\r\n\r\n"), 431, "header_too_large");
}

TEST(Hardening, H2ManyHeaderFieldsAreRefused) {
  const RunningServer server;
  std::string head = "GET /healthz HTTP/1.1\r\nHost: x\r\n";
  for (int i = 0; i < 200; ++i) head += "A: b\r\n";
  expect_refusal(server.raw(head + "\r\n"), 431, "header_too_large");
}

TEST(Hardening, H3ChunkedBodiesAreRefused) {
  const RunningServer server;
  expect_refusal(
      server.raw(request_text("POST", "/v1/assets", {"Transfer-Encoding: chunked"}) + "5\r\nhello\r\n0\r\n\r\n"), 411,
      "length_required");
}

TEST(Hardening, H4ABodyWithoutLengthIsRefused) {
  const RunningServer server;
  expect_refusal(server.raw(request_text("POST", "/v1/assets")), 411, "length_required");
}

TEST(Hardening, H5CompressedBodiesAreRefused) {
  const RunningServer server;
  expect_refusal(server.raw(request_text("POST", "/v1/assets", {"Content-Encoding: gzip"}, "xxxx")), 415,
                 "unsupported_encoding");
}

TEST(Hardening, H6ManyRangesAreRefused) {
  RunningServer server;
  const std::string id = server.make_job();
  server.service().succeed(id, {{"scene.glb", std::string(1000, 'x')}});
  const std::string target = "/v1/jobs/" + id + "/artifacts/scene.glb";
  std::vector<std::string> fields(20, "Range: bytes=0-");
  expect_refusal(server.get(target, fields), 416, "range_not_satisfiable");
  std::string list = "Range: bytes=0-";
  for (int i = 0; i < 19; ++i) list += ",0-";
  expect_refusal(server.get(target, {list}), 416, "range_not_satisfiable");
}

TEST(Hardening, H7SlowHeadsDelayNobodyAndEndAtTheirDeadline) {
  HttpOptions options = few_threads();
  options.front.head_deadline = 1500ms;
  const RunningServer server(options);
  std::vector<std::unique_ptr<RawConnection>> slow;
  for (int i = 0; i < 500; ++i) {
    slow.push_back(std::make_unique<RawConnection>(server.port()));
    slow.back()->send("GET / HT");
  }
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < 20; ++i) expect_alive(server);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 1s);  // before the first of the slow ones is given up
  const RawReply reply = slow.front()->read_reply(10s);
  EXPECT_EQ(reply.status, 408);
  EXPECT_TRUE(reply.ended);
}

TEST(Hardening, H7AConnectionThatWaitsMakesRoomForAnotherWhenAllAreTaken) {
  HttpOptions options = few_threads();
  options.front.max_connections = 8;
  const RunningServer server(options);
  std::vector<std::unique_ptr<RawConnection>> silent;
  for (int i = 0; i < 20; ++i) silent.push_back(std::make_unique<RawConnection>(server.port()));
  expect_alive(server);
}

TEST(Hardening, H7ASlowBodyIsCutWhileOthersAreServed) {
  HttpOptions options = few_threads();
  options.front.pace.idle = 300ms;
  const RunningServer server(options);
  RawConnection slow(server.port());
  slow.send("POST /v1/assets HTTP/1.1\r\nHost: x\r\nContent-Length: 100\r\n\r\nabc");
  expect_alive(server);
  EXPECT_EQ(slow.read_reply(10s).status, 408);
}

TEST(Hardening, H7UploadsHaveTheirOwnCap) {
  HttpOptions options = few_threads();
  options.max_uploads = 2;
  const RunningServer server(options);
  const std::string open_upload = request_text("POST", "/v1/assets", {"Expect: 100-continue", "Content-Length: 100"});
  RawConnection first(server.port()), second(server.port());
  for (RawConnection* upload : {&first, &second}) {
    upload->send(open_upload);
    upload->read_until("100 Continue");  // now it holds its place
  }
  const RawReply third = server.raw(request_text("POST", "/v1/assets", {}, "abc"));
  expect_refusal(third, 503, "overloaded");
  EXPECT_EQ(third.fields.count("retry-after"), 1U);
  expect_alive(server);
}

TEST(Hardening, H8HundredsOfClientsAtOnceAreAllAnswered) {
  const RunningServer server;
  std::vector<std::unique_ptr<RawConnection>> clients;
  for (int i = 0; i < 900; ++i) clients.push_back(std::make_unique<RawConnection>(server.port()));
  for (const auto& client : clients) client->send(request_text("GET", "/healthz"));
  int good = 0;
  for (const auto& client : clients) good += client->read_reply().status == 200 ? 1 : 0;
  EXPECT_EQ(good, 900);
}

TEST(Hardening, H9ARequestHiddenInABodyIsNotAnswered) {
  const RunningServer server;
  const std::string hidden = request_text("GET", "/v1/version");
  const RawReply reply = server.raw(request_text("GET", "/healthz", {}, std::string(4096, ' ') + hidden));
  EXPECT_EQ(reply.status, 200);
  EXPECT_EQ(reply.all.find("HTTP/1.1", 8), std::string::npos);
}

TEST(Hardening, H10AmbiguousLengthsAreRefused) {
  const RunningServer server;
  const std::vector<std::vector<std::string>> cases = {{"Content-Length: 3", "Transfer-Encoding: chunked"},
                                                       {"Content-Length: 3", "Content-Length: 3"},
                                                       {"Content-Length: -1"},
                                                       {"Content-Length: abc"},
                                                       {"Content-Length: 3, 3"},
                                                       {"Content-Length: +3"},
                                                       {"Content-Length: 99999999999999999999"},
                                                       {"Content-Length:"}};
  for (const auto& lines : cases) {
    SCOPED_TRACE(lines.front());
    expect_refusal(server.raw(request_text("POST", "/v1/assets", lines) + "abc"), 400, "malformed_request");
  }
}

TEST(Hardening, H10HeadsThatTwoReadersWouldReadDifferentlyAreRefused) {
  const RunningServer server;
  const std::vector<std::string> heads = {"GET /healthz HTTP/1.1\nHost: x\n\r\n\r\n",
                                          "GET /healthz HTTP/1.1\r\nHost : x\r\n\r\n",
                                          "GET /healthz HTTP/1.1\r\nHost: x\r\n folded\r\n\r\n",
                                          "GET /healthz HTTP/1.1\r\nHost: x\r\nHost: y\r\n\r\n",
                                          "GET /healthz HTTP/1.1\r\n\r\n",
                                          "GET  /healthz HTTP/1.1\r\nHost: x\r\n\r\n",
                                          "GET http://x/healthz HTTP/1.1\r\nHost: x\r\n\r\n",
                                          "GET /healthz\r\n\r\n",
                                          std::string("GET /healthz HTTP/1.1\r\nHost: x\r\nA: b\0c\r\n\r\n", 42)};
  for (const std::string& head : heads) {
    SCOPED_TRACE(head);
    expect_refusal(server.raw(head), 400, "malformed_request");
  }
}

TEST(Hardening, H11EncodedLineBreaksInFieldsAreRefusedAndNothingIsDecoded) {
  const RunningServer server;
  expect_refusal(server.get("/healthz", {"X-A: a%0d%0aEvil:1%41"}), 400, "malformed_request");
  EXPECT_EQ(server.get("/healthz", {"X-Request-Id: a%41"}).fields.at("x-request-id").substr(0, 2), "r-");
}

TEST(Hardening, H12AFieldCannotNameThePeer) {
  RunningServer server;
  server.get("/healthz", {"REMOTE_ADDR: 6.6.6.6", "X-Forwarded-For: 6.6.6.6"});
  ASSERT_EQ(server.log().size(), 1U);
  EXPECT_NE(server.log().front().find("\"peer\":\"127.0.0.1\""), std::string::npos);
  EXPECT_EQ(server.log().front().find("6.6.6.6"), std::string::npos);
}

TEST(Hardening, H13AnExceptionTellsTheClientNothing) {
  RunningServer server;
  server.service().throw_on_list("secret /srv/db/path");
  const RawReply reply = server.get("/v1/jobs");
  expect_refusal(reply, 500, "internal");
  EXPECT_EQ(reply.all.find("secret"), std::string::npos);
  EXPECT_NE(server.log().front().find("secret /srv/db/path"), std::string::npos);  // the operator sees it
}

TEST(Hardening, H14LongTargetsAndNamesDoNoHarm) {
  RunningServer server;
  expect_refusal(server.get("/" + std::string(8000, 'a')), 414, "uri_too_long");
  EXPECT_EQ(server.get("/" + std::string(4000, 'a')).status, 404);
  expect_refusal(server.get("/healthz?" + std::string(5000, 'a')), 414, "uri_too_long");
  const std::string form =
      "--b\r\nContent-Disposition: form-data; name=\"" + std::string(8000, 'n') + "\"\r\n\r\nx\r\n--b--\r\n";
  expect_refusal(server.post("/v1/jobs", "multipart/form-data; boundary=b", form), 400, "malformed_multipart");
}

TEST(Hardening, H15AChunkOfNegativeSizeIsNeverLookedAt) {
  const RunningServer server;
  expect_refusal(server.raw(request_text("POST", "/v1/assets", {"Transfer-Encoding: chunked"}) + "-2\r\nhello\r\n"),
                 411, "length_required");
}

TEST(Hardening, H16AHugeAnnouncedBodyIsRefusedBeforeItIsRead) {
  const RunningServer server;
  const auto begin = std::chrono::steady_clock::now();
  RawConnection connection(server.port());
  connection.send(request_text("POST", "/v1/assets", {"Content-Length: 1000000000000"}));
  connection.send(std::string(100'000, 'x'));
  connection.read_until("too_large");
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 5s);  // the body never ends: only an early reply comes at all
  connection.shut();
  EXPECT_EQ(connection.read_reply().status, 413);
}

TEST(Hardening, H17H18PathsReachOnlyEmbeddedFiles) {
  const RunningServer server;
  for (const char* path : {"/../etc/passwd", "/%2e%2e/etc/passwd", "/..%2f..%2fetc%2fpasswd", "/assets/../../secret",
                           "//etc/passwd", "/index.html/", "/etc/passwd"}) {
    SCOPED_TRACE(path);
    EXPECT_EQ(server.get(path).status, 404);
  }
  expect_refusal(server.get("/index.html%00.png"), 400, "malformed_request");
  expect_refusal(server.get("/%zz"), 400, "malformed_request");
  expect_refusal(server.get("/%ff"), 400, "malformed_request");
}

TEST(Hardening, H19ADownloadThatNobodyReadsIsCutAndItsPlaceIsFree) {
  HttpOptions options = few_threads();
  options.max_downloads = 1;
  options.front.pace.idle = 300ms;
  RunningServer server(options);
  const std::string id = server.make_job();
  server.service().succeed(id, {{"scene.glb", std::string(64 << 20, 'x')}});  // more than both sockets buffer
  const std::string request = request_text("GET", "/v1/jobs/" + id + "/artifacts/scene.glb", {"Range: bytes=0-"});
  RawConnection lazy(server.port());
  lazy.send(request);
  lazy.read_until("\r\n\r\n");
  const std::string small = request_text("GET", "/v1/jobs/" + id + "/artifacts/scene.glb", {"Range: bytes=0-1"});
  EXPECT_EQ(server.raw(small).status, 503);
  RawReply later;
  for (int tries = 0; tries < 200 && later.status != 206; ++tries) {
    std::this_thread::sleep_for(50ms);
    later = server.raw(small);
  }
  EXPECT_EQ(later.body, "xx");
}

// The clients are a process of their own: they must not compete with the server for the descriptors it runs out of.
pid_t hold_connections(int port, int count) {
  const pid_t child = fork();
  if (child != 0) return child;
  std::vector<int> held;
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  for (int i = 0; i < count; ++i) {
    held.push_back(socket(AF_INET, SOCK_STREAM, 0));
    if (connect(held.back(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) _exit(1);
  }
  sleep(60);  // killed long before
  _exit(0);
}

TEST(Hardening, H20TheListenerSurvivesWhenDescriptorsRunOut) {
  RunningServer server(few_threads());
  int used = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) ++used;
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  rlimit small = before;
  small.rlim_cur = static_cast<rlim_t>(used + 10);
  setrlimit(RLIMIT_NOFILE, &small);
  const pid_t clients = hold_connections(server.port(), 35);
  std::this_thread::sleep_for(300ms);  // the server runs into the limit meanwhile
  kill(clients, SIGKILL);
  waitpid(clients, nullptr, 0);
  setrlimit(RLIMIT_NOFILE, &before);
  EXPECT_EQ(server.get("/healthz").status, 200);
  const std::string metrics = server.get("/metrics").body;
  EXPECT_EQ(metrics.find("kiln_http_accept_errors_total 0\n"), std::string::npos);
}

TEST(Hardening, ABodyThatEndsEarlyIsRefusedAndLeavesNoFile) {
  RunningServer server;
  RawConnection connection(server.port());
  connection.send("POST /v1/assets HTTP/1.1\r\nHost: x\r\nContent-Length: 100\r\n\r\nabc");
  connection.shut();
  expect_refusal(connection.read_reply(), 400, "incomplete_body");
  int files = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(server.service().folder()))
    files += entry.is_regular_file() ? 1 : 0;
  EXPECT_EQ(files, 0);
}

TEST(Hardening, AClientThatAsksFirstIsToldToContinueOnlyWhenItsBodyIsWanted) {
  const RunningServer server;
  RawConnection wanted(server.port());
  wanted.send(request_text("POST", "/v1/assets", {"Expect: 100-continue", "Content-Length: 3"}));
  EXPECT_EQ(wanted.read_until("\r\n\r\n"), "HTTP/1.1 100 Continue\r\n\r\n");
  wanted.send("abc");
  EXPECT_NE(wanted.read_reply().all.find("HTTP/1.1 201 Created"), std::string::npos);

  const RawReply refused =
      server.raw(request_text("PUT", "/v1/jobs?preset=none", {"Expect: 100-continue", "Content-Length: 3"}));
  EXPECT_EQ(refused.status, 422);  // at once, no 100 before it
}

TEST(Hardening, APortCannotBeTakenTwice) {
  RunningServer server;
  HttpOptions options = few_threads();
  options.port = server.port();
  HttpServer second(options, server.service());
  const auto port = second.bind();
  ASSERT_FALSE(port.has_value());
  EXPECT_EQ(port.error().code, "bind_failed");
}

TEST(Hardening, DrainEndsStreamsAndFinishesRequestsUnderWay) {
  auto server = std::make_unique<RunningServer>();
  const int port = server->port();
  RawConnection stream(port), upload(port);
  stream.send(request_text("GET", "/v1/events"));
  stream.read_until("retry: 2000");
  upload.send(request_text("POST", "/v1/assets", {"Expect: 100-continue", "Content-Length: 6"}));
  upload.read_until("100 Continue");
  server->drain();
  upload.send("abcdef");
  EXPECT_NE(upload.read_reply().all.find("201 Created"), std::string::npos);
  EXPECT_TRUE(stream.read_reply(5s).ended);
  server.reset();  // run() returns: joins
  EXPECT_THROW(RawConnection{port}, std::runtime_error);
}

}  // namespace
}  // namespace kiln
