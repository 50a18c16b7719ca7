#pragma once
// Who is connected, in which stage and until when. Owns the descriptors; the epoll thread's own, no locks.

#include <chrono>
#include <list>
#include <optional>
#include <string>
#include <unordered_map>

#include "server/http/listener.h"

namespace kiln {

/// reading: its head is not complete. serving: a worker has it. lingering: answered, its unread bytes are discarded.
enum class Stage { reading, serving, lingering };

struct Guest {
  Peer peer;
  Stage stage = Stage::reading;
  std::string bytes;
  std::size_t discarded = 0;
  std::chrono::steady_clock::time_point deadline;  // none while serving
  std::list<int>::iterator place;                  // in the list of its stage
};

class GuestBook {
 public:
  using Clock = std::chrono::steady_clock;
  GuestBook() = default;
  ~GuestBook();
  GuestBook(const GuestBook&) = delete;
  GuestBook& operator=(const GuestBook&) = delete;

  void enter(int fd, const Peer& peer, Clock::duration head_deadline);
  void serve(int fd);
  void linger(int fd, Clock::duration limit);
  /// Closes and forgets.
  void drop(int fd);

  /// Null when there is no such guest (any more).
  Guest* find(int fd);
  std::size_t size() const { return guests_.size(); }
  std::size_t serving() const { return serving_.size(); }
  std::size_t reading() const { return reading_.size(); }
  std::size_t from(const std::string& address) const;
  const std::list<int>& all_serving() const { return serving_; }

  /// The one that has been longest in that stage; -1 when there is none. A stage has one constant duration, so it is
  /// also the first to reach its deadline.
  int oldest(Stage stage) const;
  /// The first deadline of all.
  std::optional<Clock::time_point> next_deadline() const;

 private:
  std::list<int>& line(Stage stage);
  void move_to(Guest& guest, int fd, Stage stage);

  std::unordered_map<int, Guest> guests_;
  std::unordered_map<std::string, std::size_t> per_address_;
  std::list<int> reading_, serving_, lingering_;  // oldest first
};

}  // namespace kiln
