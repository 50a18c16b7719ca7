// reliability.md 3.4: S2-S4, S6-S10, S12.

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "core/base/sha256.h"
#include "server/api/problem.h"
#include "server/http/cors.h"
#include "server/http/visitors.h"
#include "tests/server/http/raw_client.h"

namespace kiln {
namespace {

using nlohmann::json;

double peak_resident_mb() {
  std::ifstream file("/proc/self/status");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("VmHWM:")) return std::stod(line.substr(6)) / 1024;
  return 0;
}

void reset_peak() { std::ofstream("/proc/self/clear_refs") << "5"; }

AccessToken access(const std::string& token) {
  AccessToken one;
  one.hash = sha256_hex({reinterpret_cast<const std::uint8_t*>(token.data()), token.size()});
  return one;
}

TEST(Security, S2OneOfTheTokensOpensAndNothingElseDoes) {
  const std::string token = "Abc_-" + std::string(38, 'z');
  HttpOptions options = few_threads();
  options.tokens = {access(token)};
  RunningServer server(options);
  const auto status = [&](const std::string& value) {
    return server.get("/v1/jobs", {"Authorization: " + value}).status;
  };
  EXPECT_EQ(server.get("/v1/jobs").status, 401);
  EXPECT_EQ(server.get("/").status, 401);
  EXPECT_EQ(server.get("/nowhere").status, 401);
  EXPECT_EQ(server.get("/healthz").status, 200);
  EXPECT_EQ(status("Bearer " + token), 200);
  EXPECT_EQ(status("Basic bWU6QWJjXy16enp6enp6enp6enp6enp6enp6enp6enp6enp6enp6enp6enp6eg=="), 200);  // me:token
  EXPECT_EQ(status("Bearer " + token.substr(1)), 401);
  EXPECT_EQ(status("Bearer " + token + "z"), 401);
  EXPECT_EQ(status("Bearer %41" + token.substr(1)), 401);
  EXPECT_EQ(status("Bearer"), 401);
  EXPECT_EQ(status("Basic !!!"), 401);
  EXPECT_EQ(server.get("/v1/jobs", {"Authorization: Bearer x", "Authorization: Bearer " + token}).status, 401);
  for (const std::string& line : server.log()) EXPECT_EQ(line.find(token), std::string::npos);
}

TEST(Security, S2ATokenFileIsReadStrictly) {
  FakeService place;
  const std::string file = place.folder() / "tokens";
  const auto read = [&](const std::string& text) {
    std::ofstream(file) << text;
    return read_tokens(file);
  };
  const std::string token(43, 't');
  EXPECT_EQ(read("# ours\n\n" + token + "\r\n" + token + "\n")->size(), 2U);
  EXPECT_EQ(read(token + "\nshort\n").error().where, "line 2");
  EXPECT_EQ(read("# nothing\n").error().code, "bad_token_file");
  EXPECT_EQ(read_tokens(file + ".none").error().code, "bad_token_file");
}

TEST(Security, S2AWordBehindATokenThatMeansNothingIsRefused) {
  FakeService place;
  const std::string file = place.folder() / "tokens", token(43, 't');
  const auto read = [&](const std::string& words) {
    std::ofstream(file) << token << ' ' << words << '\n';
    return read_tokens(file);
  };
  const auto good = read("tenant=studio-a scopes=read jobs=5 uploads=2 rate=0.5 daily_mb=2 keep_days=30");
  ASSERT_TRUE(good);
  EXPECT_EQ(good->front().tenant, "studio-a");
  EXPECT_TRUE(good->front().read);
  EXPECT_FALSE(good->front().submit || good->front().admin);
  EXPECT_EQ(good->front().max_jobs, 5);
  EXPECT_EQ(good->front().rate, 0.5);
  EXPECT_EQ(good->front().max_daily_bytes, 2U << 20);
  EXPECT_EQ(kept_by_tenant(*good).at("studio-a"), std::chrono::hours(30 * 24));
  EXPECT_FALSE(read("tenant=a keep_days=1\n" + token + " tenant=a keep_days=2")) << "which of the two?";
  EXPECT_EQ(read("tenant=a keep_days=1\n" + token + " tenant=b keep_days=2")->size(), 2U);
  EXPECT_FALSE(read("tenant=a")->front().admin) << "a tenant does not see the others";
  EXPECT_TRUE(read("")->front().admin);
  for (const char* words :
       {"tenant=", "tenant=a/b", "scopes=", "scopes=write", "scopes=read,", "jobs=0", "jobs=-1", "jobs=x", "rate=1x",
        "colour=red", "tenant", "tenant=a scopes=admin", "jobs=3", "keep_days=3", "tenant=a keep_days=0", "daily_mb=5",
        "tenant=a daily_mb=0", "tenant=a daily_mb=-1", "tenant=a keep_days=99999"}) {
    EXPECT_FALSE(read(words)) << words;
  }
}

TEST(Security, S2AScopeOpensWhatItNamesAndNothingElse) {
  const std::string reader(43, 'r'), submitter(43, 's'), admin(43, 'a');
  HttpOptions options = few_threads();
  options.tokens = {access(reader), access(submitter), access(admin)};
  options.tokens[0].submit = options.tokens[0].admin = false;
  options.tokens[1].read = options.tokens[1].admin = false;
  RunningServer server(options);
  const auto status = [&](const char* method, const char* path, const std::string& token) {
    return server.raw(request_text(method, path, {"Authorization: Bearer " + token, "Content-Length: 0"})).status;
  };
  EXPECT_EQ(status("GET", "/v1/jobs", reader), 200);
  EXPECT_EQ(status("POST", "/v1/jobs", reader), 403);
  EXPECT_EQ(status("DELETE", "/v1/jobs/x", reader), 403);
  EXPECT_EQ(status("GET", "/metrics", reader), 403);
  EXPECT_EQ(status("GET", "/v1/jobs", submitter), 403);
  EXPECT_EQ(status("POST", "/v1/jobs/x/cancel", submitter), 404);
  EXPECT_EQ(status("GET", "/metrics", admin), 200);
}

TEST(Security, S4ATokenThatIsUsedTooOftenWaitsAndAnotherDoesNot) {
  const std::string busy(43, 'b'), calm(43, 'c');
  HttpOptions options = few_threads();
  options.tokens = {access(busy), access(calm)};
  options.tokens[0].rate = 0.5;  // five at once
  RunningServer server(options);
  const auto ask = [&](const std::string& token) { return server.get("/v1/jobs", {"Authorization: Bearer " + token}); };
  for (int i = 0; i < 5; ++i) EXPECT_EQ(ask(busy).status, 200) << i;
  RawReply refused = ask(busy);
  EXPECT_EQ(refused.status, 429);
  EXPECT_EQ(refused.fields["retry-after"], "2");
  EXPECT_EQ(ask(calm).status, 200);
}

TEST(Security, S4TheRateComesBackWithTime) {
  RateLimit limit(2);
  auto now = std::chrono::steady_clock::now();
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(limit.take(now));
  EXPECT_FALSE(limit.take(now));
  now += std::chrono::milliseconds(600);
  EXPECT_TRUE(limit.take(now));
  EXPECT_FALSE(limit.take(now));
}

TEST(Security, S3AGigabyteStreamsThroughInSmallMemory) {
  RunningServer server;
  const std::string piece(1 << 20, '\0');
  reset_peak();
  const double before = peak_resident_mb();
  RawConnection connection(server.port());
  connection.send(request_text("POST", "/v1/assets", {"Content-Length: " + std::to_string(1024ull << 20)}));
  for (int i = 0; i < 1024; ++i) ASSERT_TRUE(connection.send(piece));
  RawReply reply = connection.read_reply(std::chrono::seconds(120));
  ASSERT_EQ(reply.status, 201) << reply.all;
  EXPECT_EQ(json::parse(reply.body)["sha256"],  // sha256sum of 1 GiB of zeros
            "49bc20df15e412a64472421e13fe86ff1c5165e18b2afccf160d4dc19fe68a14");
  EXPECT_LT(peak_resident_mb() - before, 64);  // issue 2: 1 GB in, server RSS grows under 64 MB
}

TEST(Security, S6NoOriginIsEverAllowed) {
  RunningServer server;
  for (const char* origin : {"null", "https://evil.com", "https://127.0.0.1.evil", "http://localhost:1"}) {
    RawReply reply = server.get("/v1/jobs", {std::string("Origin: ") + origin});
    EXPECT_EQ(reply.fields.count("access-control-allow-origin"), 0U);
    RawReply change = server.raw(request_text("POST", "/v1/jobs/x/cancel", {std::string("Origin: ") + origin}));
    EXPECT_EQ(change.status, 403) << origin;
  }
  EXPECT_EQ(server.raw(request_text("POST", "/v1/jobs/x/cancel", {"Origin: http://127.0.0.1"})).status, 404);
  // What the browser itself says counts more: behind a proxy Host and Origin may differ.
  EXPECT_EQ(server.raw(request_text("POST", "/v1/jobs/x/cancel", {"Sec-Fetch-Site: cross-site"})).status, 403);
  EXPECT_EQ(server.raw(request_text("POST", "/v1/jobs/x/cancel", {"Sec-Fetch-Site: same-site"})).status, 403);
  EXPECT_EQ(server
                .raw(request_text("POST", "/v1/jobs/x/cancel",
                                  {"Origin: https://proxy.example", "Sec-Fetch-Site: same-origin"}))
                .status,
            404);
}

TEST(Security, S6AListedOriginAndNoOtherMayReadAndChange) {
  HttpOptions options = few_threads();
  options.origins = {"https://studio.example", "http://localhost:5173"};
  RunningServer server(options);
  const auto allowed = [&](const std::string& origin) {
    RawReply reply = server.get("/v1/jobs", {"Origin: " + origin});
    EXPECT_EQ(reply.fields["vary"], "Origin");
    EXPECT_EQ(reply.fields.count("access-control-allow-credentials"), 0U);
    return reply.fields.contains("access-control-allow-origin") ? reply.fields["access-control-allow-origin"] : "";
  };
  EXPECT_EQ(allowed("https://studio.example"), "https://studio.example");
  EXPECT_EQ(allowed("http://localhost:5173"), "http://localhost:5173");
  for (const char* origin :
       {"null", "*", "https://evil.com", "https://studio.example.evil.com", "https://studio.example:8",
        "http://studio.example", "https://STUDIO.example", "https://studio.example, null"}) {
    EXPECT_EQ(allowed(origin), "") << origin;
  }
  EXPECT_EQ(server.get("/v1/jobs").fields["vary"], "Origin") << "caches have to know without an Origin too";
  EXPECT_EQ(server.get("/v1/jobs", {"Origin: https://studio.example", "Origin: null"})
                .fields.count("access-control-allow-origin"),
            0U);
  const auto cancel = [&](const std::string& origin) {
    return server.raw(request_text("POST", "/v1/jobs/x/cancel", {"Origin: " + origin, "Sec-Fetch-Site: cross-site"}));
  };
  EXPECT_EQ(cancel("https://studio.example").status, 404);
  EXPECT_EQ(cancel("https://evil.com").status, 403);
}

TEST(Security, S6ABrowserMayAskFirstAndNeedsNoTokenForThat) {
  HttpOptions options = few_threads();
  options.origins = {"https://studio.example"};
  options.tokens = {access(std::string(43, 't'))};
  RunningServer server(options);
  const auto ask = [&](const std::string& origin, const std::string& path) {
    return server.raw(request_text("OPTIONS", path, {"Origin: " + origin, "Access-Control-Request-Method: PATCH"}));
  };
  RawReply reply = ask("https://studio.example", "/v1/uploads/x");
  EXPECT_EQ(reply.status, 204) << reply.all;
  EXPECT_EQ(reply.fields["access-control-allow-origin"], "https://studio.example");
  EXPECT_NE(reply.fields["access-control-allow-methods"].find("PATCH"), std::string::npos);
  EXPECT_NE(reply.fields["access-control-allow-headers"].find("authorization"), std::string::npos);
  EXPECT_EQ(ask("https://studio.example", "/v1/uploads").fields["access-control-allow-methods"], "POST, OPTIONS");
  RawReply stranger = ask("https://evil.com", "/v1/uploads/x");
  EXPECT_EQ(stranger.status, 401);
  EXPECT_EQ(stranger.fields.count("access-control-allow-origin"), 0U);
  RawReply real = server.get("/v1/jobs", {"Origin: https://studio.example"});
  EXPECT_EQ(real.status, 401) << "the request itself does";
  EXPECT_EQ(real.fields["access-control-allow-origin"], "https://studio.example") << "and its page may read why";
}

TEST(Security, S6AnOriginIsOneAsBrowsersWriteIt) {
  for (const char* good : {"https://a.example", "http://localhost:5173", "http://[::1]:80"})
    EXPECT_TRUE(is_origin(good));
  for (const char* bad :
       {"", "*", "null", "a.example", "https://", "https://a.example/", "https://A.example", "ftp://a"})
    EXPECT_FALSE(is_origin(bad)) << bad;
}

TEST(Security, S4ATokenUploadsSoManyBytesADayAndAnotherIsUnaffected) {
  const std::string small(43, 's'), large(43, 'l');
  HttpOptions options = few_threads();
  for (const auto& [token, tenant] : {std::pair{small, "small"}, std::pair{large, "large"}}) {
    options.tokens.push_back(access(token));
    options.tokens.back().tenant = tenant;
    options.tokens.back().admin = false;
  }
  options.tokens[0].max_daily_bytes = 1000;
  RunningServer server(options);
  const auto put = [&](const std::string& token, const std::string& text) {
    return server.raw(request_text("POST", "/v1/assets", {"Authorization: Bearer " + token}, text));
  };
  EXPECT_EQ(put(small, std::string(600, 'a')).status, 201);
  RawReply refused = put(small, std::string(401, 'b'));
  EXPECT_EQ(refused.status, 429);
  EXPECT_EQ(parse_problem(refused.body)->code, "daily_quota");
  const int wait = std::stoi(refused.fields["retry-after"]);
  EXPECT_TRUE(wait > 0 && wait <= 24 * 3600) << wait;
  EXPECT_EQ(put(large, std::string(5000, 'b')).status, 201);
  EXPECT_EQ(put(small, std::string(400, 'b')).status, 201) << "what was refused is not counted";
  EXPECT_EQ(put(small, "c").status, 429);
}

TEST(Security, S4BytesThatDidNotComeAreNotCounted) {
  const std::string token(43, 's');
  HttpOptions options = few_threads();
  options.tokens = {access(token)};
  options.tokens[0].admin = false;
  options.tokens[0].max_daily_bytes = 1000;
  RunningServer server(options);
  {
    RawConnection cut(server.port());
    cut.send("POST /v1/assets HTTP/1.1\r\nHost: h\r\nAuthorization: Bearer " + token +
             "\r\nContent-Length: 1000\r\n\r\n" + std::string(300, 'x'));
    cut.shut();
    EXPECT_EQ(cut.read_reply().status, 400);
  }
  const auto put = [&](std::size_t bytes) {
    return server.raw(request_text("POST", "/v1/assets", {"Authorization: Bearer " + token}, std::string(bytes, 'y')));
  };
  EXPECT_EQ(put(701).status, 429);
  EXPECT_EQ(put(700).status, 201);
}

TEST(Security, S10ForwardedAddressesAreBelievedFromListedProxiesAlone) {
  const auto peer_of = [](const std::vector<std::string>& proxies, const std::vector<std::string>& fields) {
    HttpOptions options = few_threads();
    options.proxies = AddressList::of(proxies).value();
    RunningServer server(options);
    server.get("/healthz", fields);
    return json::parse(server.log().at(0))["peer"].get<std::string>();
  };
  EXPECT_EQ(peer_of({}, {"X-Forwarded-For: 6.6.6.6"}), "127.0.0.1") << "spoofed";
  EXPECT_EQ(peer_of({"10.0.0.0/8"}, {"X-Forwarded-For: 6.6.6.6"}), "127.0.0.1");
  EXPECT_EQ(peer_of({"127.0.0.1"}, {"X-Forwarded-For: 203.0.113.9"}), "203.0.113.9");
  EXPECT_EQ(peer_of({"127.0.0.1"}, {}), "127.0.0.1");
  EXPECT_EQ(peer_of({"127.0.0.1"}, {"X-Forwarded-For: 6.6.6.6", "X-Forwarded-For: 7.7.7.7"}), "127.0.0.1");
}

TEST(Security, S10TheLastAddressThatIsNoProxyIsTheClients) {
  const AddressList proxies = AddressList::of({"127.0.0.1", "10.0.0.0/8", "fd00::/8"}).value();
  EXPECT_EQ(client_address("10.1.2.3", "6.6.6.6, 203.0.113.9, 10.9.9.9", proxies), "203.0.113.9");
  EXPECT_EQ(client_address("10.1.2.3", "10.4.4.4", proxies), "10.4.4.4") << "nobody else is named";
  EXPECT_EQ(client_address("fd12::1", "2001:db8::5", proxies), "2001:db8::5");
  EXPECT_EQ(client_address("11.1.2.3", "6.6.6.6", proxies), "11.1.2.3");
  EXPECT_EQ(client_address("10.1.2.3", "6.6.6.6, unknown", proxies), "10.1.2.3");
  EXPECT_EQ(client_address("10.1.2.3", "\"}{\n", proxies), "10.1.2.3");
  for (const char* bad : {"", "localhost", "10.0.0.0/33", "10.0.0.0/", "fd00::/129", "10.0.0/8", "1.2.3.4/-1"})
    EXPECT_EQ(AddressList::of({bad}).error().code, "bad_address") << bad;
  EXPECT_TRUE(AddressList::of({"0.0.0.0/0"})->holds("198.51.100.7"));
  EXPECT_FALSE(AddressList::of({"0.0.0.0/0"})->holds("2001:db8::5")) << "another family";
}

TEST(Security, ANameThatIsNotOursIsMisdirectedWhenNamesAreGiven) {
  HttpOptions options = few_threads();
  options.hosts = loopback_hosts();
  RunningServer server(options);
  EXPECT_EQ(server.raw("GET /healthz HTTP/1.1\r\nHost: evil.example:80\r\n\r\n").status, 421);
  EXPECT_EQ(server.raw("GET /healthz HTTP/1.1\r\nHost: localhost:8080\r\n\r\n").status, 200);
  EXPECT_EQ(server.raw("GET /healthz HTTP/1.1\r\nHost: [::1]:8080\r\n\r\n").status, 200);
}

TEST(Security, S7PagesCarryTheirPolicyAndEveryReplyTheOtherFields) {
  RunningServer server;
  for (const char* path : {"/", "/view/01JOB", "/docs", "/trade"}) {
    RawReply page = server.get(path);
    EXPECT_EQ(page.status, 200) << path;
    EXPECT_EQ(
        page.fields["content-security-policy"],
        "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self' blob:; style-src 'self'; "
        "img-src 'self' blob: data:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'");
  }
  for (const char* path : {"/", "/v1/jobs", "/healthz", "/nowhere", "/%zz"}) {
    RawReply reply = server.get(path);
    EXPECT_EQ(reply.fields["x-content-type-options"], "nosniff") << path;
    EXPECT_EQ(reply.fields["referrer-policy"], "no-referrer") << path;
    EXPECT_EQ(reply.fields.count("content-security-policy"), 1U) << path;
    EXPECT_FALSE(reply.fields["x-request-id"].empty()) << path;
  }
}

TEST(Security, S7NoAnswerIsEverCompressedOnTheFly) {
  RunningServer server;
  RawReply reply = server.get("/openapi.json", {"Accept-Encoding: br, gzip"});
  EXPECT_EQ(reply.fields.count("content-encoding"), 0U);
  EXPECT_TRUE(json::parse(reply.body, nullptr, false).is_object());
}

TEST(Security, S9LogLinesStayOneJsonLineWhateverStrangersSend) {
  RunningServer server;
  server.get("/%7B%22level%22:%22fatal%22%7D");
  server.get("/" + std::string(3000, 'x'), {"X-Request-Id: \"}{"});
  server.raw("GET / HTTP/9\r\n\r\n");
  for (const std::string& line : server.log()) {
    EXPECT_EQ(line.find('\n'), std::string::npos);
    const json entry = json::parse(line, nullptr, false);
    ASSERT_TRUE(entry.is_object()) << line;
    EXPECT_EQ(entry["level"], "info");
    EXPECT_LE(entry["path"].get<std::string>().size(), kMaxLogField);
  }
  AccessEntry nasty;
  nasty.path = "a\n{\"level\":\"fatal\"}\x1b[2J\xff";
  const std::string line = access_line(nasty);
  EXPECT_EQ(line.find('\n'), std::string::npos);
  EXPECT_EQ(line.find('\x1b'), std::string::npos);
  EXPECT_EQ(json::parse(line)["path"].get<std::string>().substr(0, 2), "a\n");
}

TEST(Security, S9TheQueryIsNotLogged) {
  RunningServer server;
  server.get("/v1/jobs?label=secret");
  EXPECT_EQ(server.log().at(0).find("secret"), std::string::npos);
}

TEST(Security, S12ProblemsHaveACodeARequestIdAndNoInnards) {
  RunningServer server;
  const std::vector<std::string> requests = {
      "nonsense\r\n\r\n",
      request_text("GET", "/v1/jobs/../../etc/passwd"),
      request_text("GET", "/v1/jobs?limit=x"),
      request_text("GET", "/v1/jobs/none"),
      request_text("POST", "/v1/jobs", {"Content-Type: application/json"}, "{\"a\":"),
      request_text("POST", "/v1/jobs", {"Content-Type: application/json"}, "[1]"),
      request_text("POST", "/v1/jobs", {"Content-Type: application/json"}, std::string(5000, '[')),
      request_text("POST", "/v1/jobs", {"Content-Type: application/json"}, "{\"label\":\"\xff\"}"),
      request_text("POST", "/v1/jobs", {"Content-Type: application/json"}, "{\"seed\":1,\"seed\":2}"),
      request_text("POST", "/v1/jobs", {"Content-Type: multipart/form-data"}, "x"),
      request_text("POST", "/v1/jobs", {"Content-Type: multipart/form-data; boundary=b"}, "--b"),
      request_text("PUT", "/v1/jobs?preset=nope", {}, "x"),
      request_text("PUT", "/v1/assets/zz", {}, "x"),
      request_text("PUT", "/v1/assets/" + kSha, {"Upload-Offset: 7"}, "x"),
      request_text("PUT", "/v1/assets/" + kSha + "/pin", {"Content-Length: 0"}),
      request_text("PUT", "/v1/jobs/..%2f..%2fetc%2fpasswd/pin", {"Content-Length: 0"}),
      request_text("GET", "/v1/uploads/..%2f..%2fkiln.db"),
      request_text("DELETE", "/v1/uploads/" + kSha, {"Tus-Resumable: 1.0.0"}),
      request_text("POST", "/v1/uploads", {"Content-Length: 0"}),
      request_text("POST", "/v1/uploads", {"Tus-Resumable: 1.0.0", "Upload-Length: x", "Content-Length: 0"}),
      request_text("POST", "/v1/uploads",
                   {"Tus-Resumable: 1.0.0", "Upload-Length: 9", "Upload-Metadata: ,,", "Content-Length: 0"}),
  };
  for (const std::string& text : requests) {
    SCOPED_TRACE(text.substr(0, 200));
    RawReply reply = server.raw(text);
    EXPECT_GE(reply.status, 400);
    EXPECT_LT(reply.status, 500);
    const auto problem = parse_problem(reply.body);
    ASSERT_TRUE(problem.has_value()) << reply.all;
    EXPECT_FALSE(problem->code.empty());
    EXPECT_EQ(problem->request_id, reply.fields["x-request-id"]);
    EXPECT_EQ(problem->detail.find('/'), std::string::npos) << problem->detail;
    for (const char* innard : {"std::", "nlohmann", "json.exception", "kiln-http", "/tmp", "sqlite"})
      EXPECT_EQ(reply.body.find(innard), std::string::npos) << innard;
  }
}

TEST(Security, AClientsOwnRequestIdComesBack) {
  RunningServer server;
  EXPECT_EQ(server.get("/healthz", {"X-Request-Id: abc-123"}).fields.at("x-request-id"), "abc-123");
}

}  // namespace
}  // namespace kiln
