// Many clients at once, beside slow ones and uploads. All from one thread with poll: the crowd must not starve the
// server.

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <thread>

#include "tests/soak/soak.h"

namespace kiln::testing {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

constexpr int kRounds = 3;
constexpr double kLongestS = 20;  // then a client counts as unanswered
constexpr std::size_t kUpload = 4u << 20;

class Socket {
 public:
  explicit Socket(int port) : fd_(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    if (::connect(fd_, reinterpret_cast<sockaddr*>(&to), sizeof to) != 0 && errno != EINPROGRESS) close();
  }
  ~Socket() { close(); }
  Socket(Socket&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Socket& operator=(Socket&& other) noexcept {
    close();
    fd_ = std::exchange(other.fd_, -1);
    return *this;
  }
  int fd() const { return fd_; }
  bool open() const { return fd_ >= 0; }
  void close() {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }
  bool send(std::string_view text) const {
    return ::send(fd_, text.data(), text.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(text.size());
  }

 private:
  int fd_;
};

struct Client {
  Socket socket;
  bool asked = false;
  std::string answer;
  double seconds = -1;  // until the answer was whole; -1: not yet
};

/// Clients, connections and uploads go to the servers in turn.
using Ports = std::vector<int>;
int port_of(const Ports& ports, int number) { return ports[static_cast<std::size_t>(number) % ports.size()]; }

/// All of them connect at once, ask, and read to the end.
std::vector<Client> ask_at_once(const Ports& ports, const std::string& path, int count) {
  const std::string request = "GET " + path + " HTTP/1.1\r\nHost: localhost\r\n\r\n";
  const auto begin = Clock::now();
  std::vector<Client> clients;
  for (int i = 0; i < count; ++i) clients.push_back({Socket(port_of(ports, i)), false, {}, -1});
  std::vector<pollfd> watched(clients.size());
  std::array<char, 16384> piece;
  for (bool open = true; open && seconds_since(begin) < kLongestS;) {
    open = false;
    for (std::size_t i = 0; i < clients.size(); ++i) {
      watched[i] = {clients[i].socket.fd(), static_cast<short>(clients[i].asked ? POLLIN : POLLOUT), 0};
      open = open || clients[i].socket.open();
    }
    if (!open || ::poll(watched.data(), watched.size(), 100) <= 0) continue;
    for (std::size_t i = 0; i < clients.size(); ++i) {
      Client& client = clients[i];
      if (watched[i].revents == 0) continue;
      if (!client.asked) {
        client.asked = client.socket.send(request);
        if (!client.asked) client.socket.close();
        continue;
      }
      const ssize_t got = ::recv(client.socket.fd(), piece.data(), piece.size(), 0);
      if (got > 0) {
        client.answer.append(piece.data(), static_cast<std::size_t>(got));
      } else if (got == 0 || errno != EAGAIN) {
        client.seconds = seconds_since(begin);
        client.socket.close();
      }
    }
  }
  return clients;
}

/// Connections that send a byte of their head every half second, and come again when they are thrown out.
void be_slow(const Ports& ports, int count, const std::atomic<bool>& over, std::atomic<int>& connected) {
  std::vector<Socket> slow;
  for (int i = 0; i < count; ++i) slow.emplace_back(port_of(ports, i));
  while (!over) {
    int open = 0;
    for (int i = 0; i < count; ++i) {
      Socket& socket = slow[static_cast<std::size_t>(i)];
      if (!socket.open() || !socket.send("G")) socket = Socket(port_of(ports, i));
      open += socket.open() ? 1 : 0;
    }
    connected = open;
    std::this_thread::sleep_for(500ms);
  }
}

/// One upload after another at some 400 kB/s, well above the pace that is demanded.
void upload_slowly(int port, int number, const std::atomic<bool>& over, std::atomic<int>& done, Breaches& breaches) {
  for (int i = 0; !over; ++i) {
    std::string bytes(kUpload, static_cast<char>('a' + number));
    bytes += std::to_string(number) + "." + std::to_string(i);
    Socket socket(port);
    std::string text = "PUT /v1/assets/" + sha256_of(bytes) +
                       " HTTP/1.1\r\nHost: localhost\r\nContent-Length: " + std::to_string(bytes.size()) + "\r\n\r\n" +
                       bytes;
    for (std::size_t at = 0; at < text.size();) {
      std::this_thread::sleep_for(50ms);
      pollfd watched{socket.fd(), POLLOUT, 0};
      ::poll(&watched, 1, 1000);
      const ssize_t sent =
          ::send(socket.fd(), text.data() + at, std::min<std::size_t>(20'000, text.size() - at), MSG_NOSIGNAL);
      if (sent < 0 && errno != EAGAIN) break;
      at += static_cast<std::size_t>(std::max<ssize_t>(0, sent));
      if (over) return;  // cut: nobody waits for the rest
    }
    std::array<char, 64> answer{};
    pollfd watched{socket.fd(), POLLIN, 0};
    ::poll(&watched, 1, 10'000);
    const ssize_t got = ::recv(socket.fd(), answer.data(), answer.size() - 1, 0);
    const bool taken = got > 12 && std::string_view(answer.data()).starts_with("HTTP/1.1 201");
    breaches.expect(taken, std::string("an upload was answered: ") + answer.data());
    ++done;
  }
}

}  // namespace

void run_crowd(const Crowd& crowd, Breaches& breaches) {
  Fleet fleet(crowd.postgres, crowd.postgres ? 3 : 1, {"--workers", "1"});
  Ports ports;
  for (std::size_t i = 0; i < fleet.size(); ++i) ports.push_back(fleet.node(i).port());
  const int port = ports.front();
  const std::string scene = upload_cube(port);
  const json job = json::parse(http_post(port, "/v1/jobs", cube_job(scene, 1)).body);
  const std::string path = "/v1/jobs/" + job.at("id").get<std::string>();

  std::atomic<bool> over{false};
  std::atomic<int> slow{0}, uploaded{0};
  std::vector<std::thread> others;
  others.emplace_back([&] { be_slow(ports, crowd.slow, over, slow); });
  for (int i = 0; i < crowd.uploads; ++i)
    others.emplace_back([&, i] { upload_slowly(port_of(ports, i), i, over, uploaded, breaches); });
  std::this_thread::sleep_for(2s);

  std::vector<double> seconds;
  int answered = 0, least_slow = crowd.slow;
  for (int round = 0; round < kRounds; ++round) {
    for (const Client& client : ask_at_once(ports, path, crowd.clients)) {
      const bool good = client.seconds >= 0 && client.answer.starts_with("HTTP/1.1 200");
      answered += good ? 1 : 0;
      breaches.expect(good, "a client was answered: " + client.answer.substr(0, 60));
      seconds.push_back(client.seconds < 0 ? kLongestS : client.seconds);
    }
    least_slow = std::min(least_slow, slow.load());
    std::this_thread::sleep_for(2s);
  }
  while (uploaded < crowd.uploads && breaches.count() == 0) std::this_thread::sleep_for(100ms);
  over = true;
  for (std::thread& other : others) other.join();

  std::ranges::sort(seconds);
  const double median = seconds[seconds.size() / 2], p99 = seconds[seconds.size() * 99 / 100];
  breaches.expect(p99 < 1, "the 99th percentile of a status is a second or more");
  breaches.expect(least_slow > crowd.slow / 2, "the slow connections were not there");
  std::printf(
      "{\"run\":\"crowd\",\"engine\":\"%s\",\"servers\":%zu,\"clients\":%d,\"rounds\":%d,\"slow\":%d,\"slow_at_least\":"
      "%d,\"uploads\":%d,"
      "\"uploads_done\":%d,\"answered\":%d,\"median_s\":%.3f,\"p99_s\":%.3f,\"worst_s\":%.3f,\"broken\":%d}\n",
      crowd.postgres ? "postgres" : "sqlite", ports.size(), crowd.clients, kRounds, crowd.slow, least_slow,
      crowd.uploads, uploaded.load(), answered, median, p99, seconds.back(), breaches.count());
}

}  // namespace kiln::testing
