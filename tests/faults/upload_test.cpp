// Uploads in pieces through the real kilnd: killed between and within pieces, and through a proxy that cuts
// connections.

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <httplib.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <memory>
#include <thread>

#include "core/base/base64.h"
#include "core/base/sha256.h"
#include "tests/faults/daemon.h"
#include "tests/fixtures/send_all.h"

namespace kiln::testing {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kMiB = 1u << 20;

/// Bytes that look like a scan and do not repeat.
std::string scan_of(std::size_t size) {
  std::string text = "ply\n";
  std::uint64_t state = size;
  while (text.size() < size) {
    state = state * 6364136223846793005U + 1442695040888963407U;
    text.append(reinterpret_cast<const char*>(&state), sizeof state);
  }
  text.resize(size);
  return text;
}

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

int connect_to(int port) {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0) return fd;
  ::close(fd);
  return -1;
}

/// Passes connections on, and ends the first ones after so many bytes of their client.
class CuttingProxy {
 public:
  CuttingProxy(int server, std::vector<std::size_t> cuts) : server_(server), cuts_(std::move(cuts)) {
    listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    EXPECT_EQ(::bind(listener_, reinterpret_cast<sockaddr*>(&address), size), 0);
    EXPECT_EQ(::listen(listener_, 16), 0);
    ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { work(); });
  }
  ~CuttingProxy() {
    ::shutdown(listener_, SHUT_RDWR);
    thread_.join();
    ::close(listener_);
  }
  int port() const { return port_; }
  std::size_t from_clients() const { return from_clients_; }
  std::size_t cuts_left() const { return cuts_.size() - cut_; }

 private:
  void work() {
    for (int client = 0; (client = ::accept(listener_, nullptr, nullptr)) >= 0;) {
      const int server = connect_to(server_);
      pass_on(client, server);
      ::close(client);
      ::close(server);
    }
  }

  /// One connection at a time: the client under test has no more.
  void pass_on(int client, int server) {
    const std::size_t cut = cut_ < cuts_.size() ? cuts_[cut_] : SIZE_MAX;
    std::string piece(64 * 1024, '\0');
    std::size_t came = 0;
    for (;;) {
      pollfd ends[2] = {{client, POLLIN, 0}, {server, POLLIN, 0}};
      ::poll(ends, 2, -1);
      const bool upwards = ends[0].revents != 0;
      const ssize_t got = ::recv(upwards ? client : server, piece.data(), piece.size(), 0);
      if (got <= 0) return;
      if (!send_all(upwards ? server : client, {piece.data(), static_cast<std::size_t>(got)})) return;
      if (!upwards) continue;
      came += static_cast<std::size_t>(got);
      from_clients_ += static_cast<std::size_t>(got);
      if (came < cut) continue;
      ++cut_;
      return;
    }
  }

  int server_, listener_ = -1, port_ = 0;
  const std::vector<std::size_t> cuts_;
  std::atomic<std::size_t> cut_{0}, from_clients_{0};
  std::thread thread_;
};

class UploadTest : public ::testing::Test {
 protected:
  UploadTest() {
    std::string name = (std::filesystem::temp_directory_path() / "kiln_upload.XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
    start();
  }
  ~UploadTest() override {
    daemon_.reset();
    std::filesystem::remove_all(folder_);
  }
  void start() {
    daemon_ = std::make_unique<Daemon>(KILN_DAEMON, folder_ / "data",
                                       std::vector<std::string>{"--workers", "0", "--soft-free-percent", "0"});
  }
  httplib::Client client() const {
    httplib::Client http("127.0.0.1", daemon_->port());
    http.set_read_timeout(30s);
    http.set_default_headers({{"Tus-Resumable", "1.0.0"}});
    return http;
  }
  std::string begin(const std::string& whole) const {
    const httplib::Headers headers{
        {"Upload-Length", std::to_string(whole.size())},
        {"Upload-Metadata", "sha256 " + base64_encode(bytes_of(sha256_hex(bytes_of(whole))))}};
    const auto begun = client().Post("/v1/uploads", headers, "", "");
    EXPECT_EQ(begun->status, 201);
    return begun->get_header_value("Location");
  }
  std::size_t offset(const std::string& upload) const {
    return std::strtoull(client().Head(upload)->get_header_value("Upload-Offset").c_str(), nullptr, 10);
  }
  httplib::Result patch(const std::string& upload, std::size_t at, const std::string& bytes) const {
    return client().Patch(upload, {{"Upload-Offset", std::to_string(at)}}, bytes, "application/offset+octet-stream");
  }

  std::filesystem::path folder_;
  std::unique_ptr<Daemon> daemon_;
};

TEST_F(UploadTest, WhatWasAcknowledgedIsThereAfterKill9) {
  const std::string whole = scan_of(44 * kMiB);
  const std::string upload = begin(whole);
  ASSERT_EQ(patch(upload, 0, whole.substr(0, 6 * kMiB))->status, 204);
  daemon_->kill_hard();
  start();
  ASSERT_EQ(offset(upload), 6 * kMiB);
  // Now within a piece: bytes count 16 MiB at a time.
  const int fd = connect_to(daemon_->port());
  send_all(fd, "PATCH " + upload + " HTTP/1.1\r\nHost: 127.0.0.1\r\nTus-Resumable: 1.0.0\r\nUpload-Offset: " +
                   std::to_string(6 * kMiB) + "\r\nContent-Type: application/offset+octet-stream\r\nContent-Length: " +
                   std::to_string(38 * kMiB) + "\r\n\r\n");
  send_all(fd, std::string_view(whole).substr(6 * kMiB, 20 * kMiB));
  std::size_t told = 0;
  for (int i = 0; i < 1000 && told < 22 * kMiB; ++i) {
    std::this_thread::sleep_for(10ms);
    told = offset(upload);
  }
  ASSERT_GE(told, 22 * kMiB);
  EXPECT_EQ(patch(upload, told, "x")->status, 409) << "one writer at a time";
  daemon_->kill_hard();
  ::close(fd);
  start();
  const std::size_t kept = offset(upload);
  EXPECT_GE(kept, told);
  const auto last = patch(upload, kept, whole.substr(kept));
  ASSERT_EQ(last->status, 204) << last->body;
  const std::string asset = last->get_header_value("Upload-Asset");
  EXPECT_EQ(asset, sha256_hex(bytes_of(whole)));
  EXPECT_TRUE(client().Get("/v1/assets/" + asset)->body == whole);
  daemon_->kill_hard();
  start();
  EXPECT_EQ(client().Head("/v1/assets/" + asset)->status, 200);
  EXPECT_EQ(client().Head(upload)->get_header_value("Upload-Asset"), asset) << "for whoever missed the last answer";
}

TEST_F(UploadTest, TheClientGoesOnAfterEveryCutAndSendsNothingTwice) {
  const std::string whole = scan_of(40 * kMiB);
  const std::filesystem::path file = folder_ / "scan.ply";
  std::ofstream(file, std::ios::binary) << whole;
  CuttingProxy proxy(daemon_->port(), {5 * kMiB, 11 * kMiB, 3 * kMiB});
  const std::string command = std::string(KILN_PROGRAM) + " submit " + file.string() + " --preset prt --server " +
                              "http://127.0.0.1:" + std::to_string(proxy.port()) + " >" + (folder_ / "out").string() +
                              " 2>&1";
  const int status = std::system(command.c_str());
  std::ifstream out(folder_ / "out");
  const std::string said{std::istreambuf_iterator<char>(out), {}};
  EXPECT_EQ(status, 0) << said;
  EXPECT_EQ(proxy.cuts_left(), 0U);
  EXPECT_NE(said.find("going on at"), std::string::npos) << said;
  const std::string asset = sha256_hex(bytes_of(whole));
  EXPECT_TRUE(client().Get("/v1/assets/" + asset)->body == whole);
  // Beside the file: heads, and what lay in the buffers of the three connections that were cut.
  EXPECT_LT(proxy.from_clients(), whole.size() + 3 * kMiB);
  std::printf("file %zu bytes, sent %zu over 3 cuts\n", whole.size(), proxy.from_clients());
}

}  // namespace
}  // namespace kiln::testing
