#include "tests/server/http/raw_client.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <stdexcept>

namespace kiln {

using Clock = std::chrono::steady_clock;

RawConnection::RawConnection(int port) : fd_(socket(AF_INET, SOCK_STREAM, 0)) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    throw std::runtime_error("cannot connect to the server under test");
}

RawConnection::~RawConnection() { close(fd_); }

void RawConnection::shut() { shutdown(fd_, SHUT_WR); }

bool RawConnection::send(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
  return true;
}

bool RawConnection::read_some(Clock::time_point end) {
  const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now()).count();
  pollfd entry{fd_, POLLIN, 0};
  if (left <= 0 || poll(&entry, 1, static_cast<int>(left)) <= 0) return false;
  std::array<char, 65536> piece;
  const ssize_t got = recv(fd_, piece.data(), piece.size(), 0);
  if (got <= 0) return false;
  received_.append(piece.data(), static_cast<std::size_t>(got));
  return true;
}

const std::string& RawConnection::read_until(const std::string& text, std::chrono::milliseconds limit) {
  const Clock::time_point end = Clock::now() + limit;
  while (received_.find(text) == std::string::npos && read_some(end)) {
  }
  return received_;
}

RawReply RawConnection::read_reply(std::chrono::milliseconds limit) {
  const Clock::time_point end = Clock::now() + limit;
  while (read_some(end)) {
  }
  RawReply reply = parse_reply(received_);
  reply.ended = Clock::now() < end;
  return reply;
}

RawReply parse_reply(const std::string& bytes) {
  RawReply reply;
  reply.all = bytes;
  const std::size_t end = bytes.find("\r\n\r\n");
  if (!bytes.starts_with("HTTP/1.1 ") || end == std::string::npos) return reply;
  reply.status = std::stoi(bytes.substr(9, 3));
  reply.head = bytes.substr(0, end + 2);
  reply.body = bytes.substr(end + 4);
  std::size_t at = reply.head.find("\r\n") + 2;
  while (at < reply.head.size()) {
    const std::size_t stop = reply.head.find("\r\n", at);
    const std::string line = reply.head.substr(at, stop - at);
    std::string name = line.substr(0, line.find(':'));
    std::transform(name.begin(), name.end(), name.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    reply.fields[name] = line.substr(std::min(line.size(), line.find(':') + 2));
    at = stop + 2;
  }
  return reply;
}

std::string request_text(const std::string& method, const std::string& target, const std::vector<std::string>& lines,
                         const std::string& body) {
  std::string text = method + " " + target + " HTTP/1.1\r\nHost: 127.0.0.1\r\n";
  for (const std::string& line : lines) text += line + "\r\n";
  if (!body.empty()) text += "Content-Length: " + std::to_string(body.size()) + "\r\n";
  return text + "\r\n" + body;
}

HttpOptions few_threads() {
  HttpOptions options;
  options.max_uploads = options.max_streams = options.max_downloads = options.quick_threads = 4;
  return options;
}

RunningServer::RunningServer(HttpOptions options) {
  options.port = 0;
  options.log = [this](std::string_view line) {
    const std::lock_guard lock(log_mutex_);
    log_.emplace_back(line);
  };
  server_ = std::make_unique<HttpServer>(options, service_);
  port_ = server_->bind().value();
  thread_ = std::thread([this] { server_->run(); });
}

RunningServer::~RunningServer() {
  service_.drain();
  server_->drain();
  thread_.join();
}

RawReply RunningServer::raw(const std::string& bytes) const {
  RawConnection connection(port_);
  connection.send(bytes);
  return connection.read_reply();
}

RawReply RunningServer::get(const std::string& target, const std::vector<std::string>& lines) const {
  return raw(request_text("GET", target, lines));
}

RawReply RunningServer::post(const std::string& target, const std::string& type, const std::string& body) const {
  return raw(request_text("POST", target, {"Content-Type: " + type}, body));
}

std::string RunningServer::make_job(const std::string& label) {
  Submission submission;
  submission.scene_sha256 = kSha;
  submission.recipe.label = label;
  return service_.submit(submission)->job.id;
}

std::vector<std::string> RunningServer::log() {
  const std::lock_guard lock(log_mutex_);
  return log_;
}

}  // namespace kiln
