#include "server/http/front.h"

#include <errno.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <list>
#include <mutex>
#include <optional>
#include <thread>
#include <unordered_map>
#include <vector>

#include "server/http/listener.h"
#include "server/http/work_queue.h"

namespace kiln {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kDiscardLimit = 16u << 20;  // bytes thrown away after a reply before the connection is cut
constexpr auto kAcceptPause = std::chrono::milliseconds(100);

enum class Stage { reading, serving, lingering };

struct Guest {
  Peer peer;
  Stage stage = Stage::reading;
  std::string bytes;
  std::size_t discarded = 0;
  Clock::time_point deadline;
  std::list<int>::iterator place;  // in the list of its stage
};

bool is_resource_shortage(int error) {
  return error == EMFILE || error == ENFILE || error == ENOBUFS || error == ENOMEM;
}

}  // namespace

struct Front::State {
  FrontOptions options;
  ServeHead serve;
  WorkQueue queue;
  Listener listener;
  int epoll = -1;
  int wake = -1;
  std::atomic<bool> draining{false};

  // The epoll thread's own.
  std::unordered_map<int, Guest> guests;
  std::unordered_map<std::string, std::size_t> per_address;
  std::list<int> reading, lingering;  // oldest first; every stage has one constant duration, so also by deadline
  std::size_t serving = 0;
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

  State(FrontOptions o, ServeHead s) : options(std::move(o)), serve(std::move(s)), queue(options.max_queued) {}

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

  void leave_stage(Guest& guest) {
    if (guest.stage == Stage::reading) reading.erase(guest.place);
    if (guest.stage == Stage::lingering) lingering.erase(guest.place);
    if (guest.stage == Stage::serving) --serving;
  }

  void drop(int fd) {
    const auto found = guests.find(fd);
    leave_stage(found->second);
    const auto address = per_address.find(found->second.peer.address);
    if (--address->second == 0) per_address.erase(address);
    guests.erase(found);
    ::close(fd);
  }

  void linger(int fd) {
    Guest& guest = guests.at(fd);
    leave_stage(guest);
    guest.bytes = {};
    guest.stage = Stage::lingering;
    guest.deadline = Clock::now() + options.linger;
    guest.place = lingering.insert(lingering.end(), fd);
    shutdown(fd, SHUT_WR);
  }

  void refuse_now(int fd, const Problem& problem) {
    const std::string reply = bare_refusal(problem.status, problem);
    [[maybe_unused]] const ssize_t ignored = send(fd, reply.data(), reply.size(), MSG_NOSIGNAL);
    linger(fd);
  }

  void admit(int fd, const Peer& peer) {
    std::size_t& from_there = per_address[peer.address];
    if (!peer.loopback && from_there >= options.max_per_address) {
      count([](FrontStats& s) { ++s.over_address_cap; });
      ::close(fd);
      return;
    }
    ++from_there;
    Guest& guest = guests[fd];
    guest.peer = peer;
    guest.deadline = Clock::now() + options.head_deadline;
    guest.place = reading.insert(reading.end(), fd);
    watch(fd);
    count([](FrontStats& s) { ++s.accepted; });
  }

  bool make_room() {
    if (guests.size() < options.max_connections) return true;
    if (reading.empty() && lingering.empty()) return false;
    drop(lingering.empty() ? reading.front() : lingering.front());
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
      if (is_resource_shortage(error) && !reading.empty()) drop(reading.front());
      return pause_accepting();
    }
  }

  void hand_over(int fd, std::size_t head_size) {
    Guest& guest = guests.at(fd);
    HeadJob job{fd, guest.peer.address, std::move(guest.bytes), head_size};
    unwatch(fd);
    leave_stage(guest);
    guest.stage = Stage::serving;
    ++serving;
    if (queue.push(job)) return;
    count([](FrontStats& s) { ++s.queue_full; });
    watch(fd);
    refuse_now(fd, make_problem("overloaded", "too many requests wait already; try again in a moment"));
  }

  void read_head(int fd) {
    Guest& guest = guests.at(fd);
    std::array<char, 16384> piece;
    const ssize_t got = recv(fd, piece.data(), piece.size(), 0);
    if (got < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (got <= 0) return drop(fd);
    const std::size_t searched = guest.bytes.size() < 3 ? 0 : guest.bytes.size() - 3;
    guest.bytes.append(piece.data(), static_cast<std::size_t>(got));
    const std::size_t end = guest.bytes.find("\r\n\r\n", searched);
    if (end != std::string::npos && end + 4 <= options.head_bytes) return hand_over(fd, end + 4);
    if (end == std::string::npos && guest.bytes.size() < options.head_bytes) return;
    count([](FrontStats& s) { ++s.head_too_large; });
    refuse_now(fd, make_problem("header_too_large",
                                "a request head may have " + std::to_string(options.head_bytes) + " bytes"));
  }

  void discard(int fd) {
    Guest& guest = guests.at(fd);
    std::array<char, 65536> piece;
    const ssize_t got = recv(fd, piece.data(), piece.size(), 0);
    if (got < 0 && (errno == EAGAIN || errno == EINTR)) return;
    guest.discarded += got > 0 ? static_cast<std::size_t>(got) : 0;
    if (got <= 0 || guest.discarded > kDiscardLimit) drop(fd);
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
        drop(one.fd);
      } else {
        linger(one.fd);
        watch(one.fd);
      }
    }
  }

  // --- the clock

  void expire(Clock::time_point now) {
    while (!reading.empty() && guests.at(reading.front()).deadline <= now) {
      count([](FrontStats& s) { ++s.head_timeouts; });
      refuse_now(reading.front(), make_problem("timeout", "the request head did not come in time"));
    }
    while (!lingering.empty() && guests.at(lingering.front()).deadline <= now) drop(lingering.front());
    if (accept_again && *accept_again <= now && listener.fd >= 0) {
      accept_again.reset();
      watch(listener.fd);
    }
    if (cut_at && *cut_at <= now) cut_serving();
  }

  int sleep_ms(Clock::time_point now) const {
    std::optional<Clock::time_point> next = accept_again;
    const auto consider = [&](Clock::time_point t) { next = next ? std::min(*next, t) : t; };
    if (!reading.empty()) consider(guests.at(reading.front()).deadline);
    if (!lingering.empty()) consider(guests.at(lingering.front()).deadline);
    if (cut_at) consider(*cut_at);
    if (!next) return -1;
    return static_cast<int>(
        std::max<std::int64_t>(0, std::chrono::duration_cast<std::chrono::milliseconds>(*next - now).count() + 1));
  }

  // --- the end

  void begin_drain() {
    ::close(listener.fd);
    listener.fd = -1;
    accept_again.reset();
    cut_at = Clock::now() + options.drain_grace;
  }

  void cut_serving() {
    for (const auto& [fd, guest] : guests)
      if (guest.stage == Stage::serving) shutdown(fd, SHUT_RDWR);
    cut_at.reset();
  }

  void publish_stats() {
    count([this](FrontStats& s) {
      s.connections = guests.size();
      s.serving = serving;
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
      } else if (const auto guest = guests.find(fd); guest != guests.end()) {  // else dropped in this very turn
        if (guest->second.stage == Stage::reading)
          read_head(fd);
        else if (guest->second.stage == Stage::lingering)
          discard(fd);
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

Front::Front(FrontOptions options, ServeHead serve)
    : state_(std::make_unique<State>(std::move(options), std::move(serve))) {
  state_->epoll = epoll_create1(EPOLL_CLOEXEC);
  state_->wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
}

Front::~Front() {
  for (const auto& [fd, guest] : state_->guests) ::close(fd);
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
  for (int i = 0; i < s.options.threads; ++i) workers.emplace_back([&s] { s.work(); });
  s.watch(s.wake);
  s.watch(s.listener.fd);
  bool drain_begun = false;
  while (!drain_begun || s.serving > 0 || !s.reading.empty()) {
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
