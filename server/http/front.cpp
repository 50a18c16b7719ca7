#include "server/http/front.h"

#include <errno.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "server/http/guest_book.h"
#include "server/http/listener.h"
#include "server/http/work_queue.h"

namespace kiln {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kDiscardLimit = 16u << 20;  // bytes thrown away after a reply before the connection is cut
constexpr auto kAcceptPause = std::chrono::milliseconds(100);

bool is_resource_shortage(int error) {
  return error == EMFILE || error == ENFILE || error == ENOBUFS || error == ENOMEM;
}

}  // namespace

struct Front::State {
  FrontOptions options;
  ServeHead serve;
  RefusalText refusal;
  WorkQueue queue;
  Listener listener;
  int epoll = -1;
  int wake = -1;
  std::atomic<bool> draining{false};

  // The epoll thread's own.
  GuestBook guests;
  std::optional<Clock::time_point> accept_again;
  std::optional<Clock::time_point> cut_at;

  // Workers hand connections back through this.
  struct Returned {
    int fd;
    bool complete;
  };
  std::mutex returned_mutex;
  std::vector<Returned> returned;

  mutable std::mutex stats_mutex;
  FrontStats stats;

  State(FrontOptions o, ServeHead s, RefusalText r)
      : options(std::move(o)), serve(std::move(s)), refusal(std::move(r)), queue(options.max_queued) {}

  template <class Change>
  void count(Change change) {
    const std::lock_guard lock(stats_mutex);
    change(stats);
  }

  void notify() noexcept {
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t ignored = ::write(wake, &one, sizeof one);
  }

  void watch(int fd) {
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.fd = fd;
    epoll_ctl(epoll, EPOLL_CTL_ADD, fd, &event);
  }
  void unwatch(int fd) { epoll_ctl(epoll, EPOLL_CTL_DEL, fd, nullptr); }

  // --- a guest's way: reading -> serving -> lingering -> gone

  void linger(int fd) {
    guests.linger(fd, options.linger);
    shutdown(fd, SHUT_WR);
  }

  void refuse_now(int fd, const Problem& problem) {
    const std::string reply = refusal(problem);
    [[maybe_unused]] const ssize_t ignored = send(fd, reply.data(), reply.size(), MSG_NOSIGNAL);
    linger(fd);
  }

  void admit(int fd, const Peer& peer) {
    const bool many = peer.loopback || options.proxies.holds(peer.address);
    if (!many && guests.from(peer.address) >= options.max_per_address) {
      count([](FrontStats& s) { ++s.over_address_cap; });
      ::close(fd);
      return;
    }
    guests.enter(fd, peer, options.head_deadline);
    watch(fd);
    count([](FrontStats& s) { ++s.accepted; });
  }

  /// Whoever has been answered, or has waited longest for its own head, makes room.
  bool make_room() {
    if (guests.size() < options.max_connections) return true;
    const int lingering = guests.oldest(Stage::lingering);
    const int reading = guests.oldest(Stage::reading);
    if (lingering < 0 && reading < 0) return false;
    guests.drop(lingering < 0 ? reading : lingering);
    count([](FrontStats& s) { ++s.evicted; });
    return true;
  }

  void pause_accepting() {
    unwatch(listener.fd);
    accept_again = Clock::now() + kAcceptPause;
  }

  void accept_some() {
    for (int i = 0; i < 256; ++i) {
      Peer peer;
      const int fd = accept_connection(listener.fd, peer);
      if (fd >= 0) {
        if (make_room()) {
          admit(fd, peer);
        } else {
          ::close(fd);
        }
        continue;
      }
      const int error = errno;
      if (error == EAGAIN || error == EWOULDBLOCK) return;
      if (error == EINTR || error == ECONNABORTED) continue;
      count([](FrontStats& s) { ++s.accept_errors; });
      if (is_resource_shortage(error) && guests.reading() > 0) guests.drop(guests.oldest(Stage::reading));
      return pause_accepting();
    }
  }

  void hand_over(int fd, std::size_t head_size) {
    Guest& guest = *guests.find(fd);
    HeadJob job{fd, guest.peer.address, std::move(guest.bytes), head_size};
    unwatch(fd);
    guests.serve(fd);
    if (queue.push(job)) return;
    count([](FrontStats& s) { ++s.queue_full; });
    watch(fd);
    refuse_now(fd, make_problem("overloaded", "too many requests wait already; try again in a moment"));
  }

  void read_head(int fd, Guest& guest) {
    std::array<char, 16384> piece;
    const ssize_t got = recv(fd, piece.data(), piece.size(), 0);
    if (got < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (got <= 0) return guests.drop(fd);
    const std::size_t searched = guest.bytes.size() < 3 ? 0 : guest.bytes.size() - 3;
    guest.bytes.append(piece.data(), static_cast<std::size_t>(got));
    const std::size_t end = guest.bytes.find("\r\n\r\n", searched);
    if (end != std::string::npos && end + 4 <= options.head_bytes) return hand_over(fd, end + 4);
    if (end == std::string::npos && guest.bytes.size() < options.head_bytes) return;
    count([](FrontStats& s) { ++s.head_too_large; });
    refuse_now(fd, make_problem("header_too_large",
                                "a request head may have " + std::to_string(options.head_bytes) + " bytes"));
  }

  void discard(int fd, Guest& guest) {
    std::array<char, 65536> piece;
    const ssize_t got = recv(fd, piece.data(), piece.size(), 0);
    if (got < 0 && (errno == EAGAIN || errno == EINTR)) return;
    guest.discarded += got > 0 ? static_cast<std::size_t>(got) : 0;
    if (got <= 0 || guest.discarded > kDiscardLimit) guests.drop(fd);
  }

  void take_back() {
    std::uint64_t ignored = 0;
    [[maybe_unused]] const ssize_t got = ::read(wake, &ignored, sizeof ignored);
    std::vector<Returned> now;
    {
      const std::lock_guard lock(returned_mutex);
      now.swap(returned);
    }
    for (const Returned& one : now) {
      if (one.complete) {
        guests.drop(one.fd);
      } else {
        linger(one.fd);
        watch(one.fd);
      }
    }
  }

  // --- the clock

  bool is_over(int fd, Clock::time_point now) { return fd >= 0 && guests.find(fd)->deadline <= now; }

  void expire(Clock::time_point now) {
    for (int fd = guests.oldest(Stage::reading); is_over(fd, now); fd = guests.oldest(Stage::reading)) {
      count([](FrontStats& s) { ++s.head_timeouts; });
      refuse_now(fd, make_problem("timeout", "the request head did not come in time"));
    }
    for (int fd = guests.oldest(Stage::lingering); is_over(fd, now); fd = guests.oldest(Stage::lingering))
      guests.drop(fd);
    if (accept_again && *accept_again <= now && listener.fd >= 0) {
      accept_again.reset();
      watch(listener.fd);
    }
    if (cut_at && *cut_at <= now) cut_serving();
  }

  /// Until the next thing that happens by itself; -1: nothing does.
  int sleep_ms(Clock::time_point now) const {
    std::optional<Clock::time_point> next;
    for (const auto& moment : {guests.next_deadline(), accept_again, cut_at})
      if (moment && (!next || *moment < *next)) next = moment;
    if (!next) return -1;
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(*next - now).count() + 1;
    return static_cast<int>(std::max<std::int64_t>(0, left));
  }

  // --- the end

  void begin_drain() {
    ::close(listener.fd);
    listener.fd = -1;
    accept_again.reset();
    cut_at = Clock::now() + options.drain_grace;
  }

  void cut_serving() {
    for (const int fd : guests.all_serving()) shutdown(fd, SHUT_RDWR);
    cut_at.reset();
  }

  void publish_stats() {
    count([this](FrontStats& s) {
      s.connections = guests.size();
      s.serving = guests.serving();
      s.queued = queue.size();
    });
  }

  void turn() {
    std::array<epoll_event, 256> events;
    const int ready = epoll_wait(epoll, events.data(), static_cast<int>(events.size()), sleep_ms(Clock::now()));
    for (int i = 0; i < ready; ++i) {
      const int fd = events[static_cast<std::size_t>(i)].data.fd;
      if (fd == wake) {
        take_back();
      } else if (fd == listener.fd) {
        accept_some();
      } else if (Guest* guest = guests.find(fd)) {  // else it was dropped in this very turn
        if (guest->stage == Stage::reading)
          read_head(fd, *guest);
        else if (guest->stage == Stage::lingering)
          discard(fd, *guest);
      }
    }
    expire(Clock::now());
    publish_stats();
  }

  bool serve_safely(Connection& connection, const HeadJob& job) {
    try {
      return serve(connection, job.bytes, job.peer);
    } catch (const std::exception&) {  // out of memory before a reply could be made: this connection ends, no other
      return false;
    }
  }

  void work() {
    while (auto job = queue.pop()) {
      Connection connection(job->fd, job->bytes.substr(job->head_size), options.pace);
      job->bytes.resize(job->head_size);
      const bool complete = serve_safely(connection, *job);
      {
        const std::lock_guard lock(returned_mutex);
        returned.push_back({job->fd, complete});
      }
      notify();
    }
  }
};

Front::Front(FrontOptions options, ServeHead serve, RefusalText refusal)
    : state_(std::make_unique<State>(std::move(options), std::move(serve), std::move(refusal))) {
  state_->epoll = epoll_create1(EPOLL_CLOEXEC);
  state_->wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
}

Front::~Front() {
  for (const int fd : {state_->listener.fd, state_->epoll, state_->wake})
    if (fd >= 0) ::close(fd);
}

Result<int> Front::bind() {
  KILN_TRY(listener, open_listener(state_->options.address, state_->options.port, state_->options.backlog));
  state_->listener = listener;
  return listener.port;
}

void Front::run() {
  State& s = *state_;
  std::vector<std::jthread> workers;
  workers.reserve(static_cast<std::size_t>(s.options.threads));
  for (int i = 0; i < s.options.threads; ++i) workers.emplace_back([&s] { s.work(); });
  s.watch(s.wake);
  s.watch(s.listener.fd);
  bool drain_begun = false;
  while (!drain_begun || s.guests.serving() > 0 || s.guests.reading() > 0) {
    s.turn();
    if (s.draining.load() && !std::exchange(drain_begun, true)) s.begin_drain();
  }
  s.queue.close();
}

void Front::drain() noexcept {
  state_->draining.store(true);
  state_->notify();
}

FrontStats Front::stats() const {
  const std::lock_guard lock(state_->stats_mutex);
  return state_->stats;
}

}  // namespace kiln
