#include "server/http/connection.h"

#include <errno.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstring>
#include <utility>

namespace kiln {

Connection::Connection(int fd, std::string read_ahead, Pace pace)
    : fd_(fd), read_ahead_(std::move(read_ahead)), pace_(pace) {}

bool Connection::wait(short events, Account& account) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point begin = Clock::now();
  pollfd entry{fd_, events, 0};
  int ready = 0;
  do {
    ready = poll(&entry, 1, static_cast<int>(pace_.idle.count()));
  } while (ready < 0 && errno == EINTR);
  account.waited += Clock::now() - begin;
  const double seconds = std::chrono::duration<double>(account.waited).count();
  const bool too_slow =
      account.waited > pace_.grace && static_cast<double>(account.bytes) < pace_.bytes_per_s * seconds;
  return ready > 0 && !too_slow;
}

Answer<std::size_t> Connection::read(std::span<std::uint8_t> out) {
  if (read_ahead_used_ < read_ahead_.size()) {
    const std::size_t count = std::min(out.size(), read_ahead_.size() - read_ahead_used_);
    std::memcpy(out.data(), read_ahead_.data() + read_ahead_used_, count);
    read_ahead_used_ += count;
    return count;
  }
  while (true) {
    const ssize_t got = recv(fd_, out.data(), out.size(), 0);
    if (got >= 0) {
      received_.bytes += static_cast<std::uint64_t>(got);
      return static_cast<std::size_t>(got);
    }
    if (errno == EINTR) continue;
    if (errno != EAGAIN && errno != EWOULDBLOCK) return std::size_t{0};
    if (!wait(POLLIN, received_)) return refuse("timeout", "the body comes too slowly");
  }
}

bool Connection::write(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent >= 0) {
      sent_.bytes += static_cast<std::uint64_t>(sent);
      bytes.remove_prefix(static_cast<std::size_t>(sent));
    } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
      if (!wait(POLLOUT, sent_)) return false;
    } else if (errno != EINTR) {
      return false;
    }
  }
  return true;
}

bool Connection::client_gone() {
  pollfd entry{fd_, POLLRDHUP, 0};
  return poll(&entry, 1, 0) > 0 && (entry.revents & (POLLRDHUP | POLLHUP | POLLERR)) != 0;
}

Answer<std::size_t> ConnectionBody::read(std::span<std::uint8_t> out) {
  const std::uint64_t left = length_ - taken_;
  if (left == 0 || out.empty()) return std::size_t{0};
  if (std::exchange(expects_continue_, false) && !connection_->write("HTTP/1.1 100 Continue\r\n\r\n"))
    return refuse("incomplete_body", "the connection ended before the body");
  auto got = connection_->read(out.first(static_cast<std::size_t>(std::min<std::uint64_t>(left, out.size()))));
  if (!got) return got;
  if (*got == 0)
    return refuse("incomplete_body",
                  "the body ended after " + std::to_string(taken_) + " of " + std::to_string(length_) + " bytes");
  taken_ += *got;
  return got;
}

}  // namespace kiln
