#include "server/http/guest_book.h"

#include <unistd.h>

#include <algorithm>

#include "core/base/expects.h"

namespace kiln {

GuestBook::~GuestBook() {
  for (const auto& [fd, guest] : guests_) ::close(fd);
}

std::list<int>& GuestBook::line(Stage stage) {
  return stage == Stage::reading ? reading_ : stage == Stage::serving ? serving_ : lingering_;
}

void GuestBook::move_to(Guest& guest, int fd, Stage stage) {
  line(guest.stage).erase(guest.place);
  guest.stage = stage;
  guest.place = line(stage).insert(line(stage).end(), fd);
}

void GuestBook::enter(int fd, const Peer& peer, Clock::duration head_deadline) {
  EXPECTS(!guests_.contains(fd));
  Guest& guest = guests_[fd];
  guest.peer = peer;
  guest.deadline = Clock::now() + head_deadline;
  guest.place = reading_.insert(reading_.end(), fd);
  ++per_address_[peer.address];
}

void GuestBook::serve(int fd) { move_to(guests_.at(fd), fd, Stage::serving); }

void GuestBook::linger(int fd, Clock::duration limit) {
  Guest& guest = guests_.at(fd);
  move_to(guest, fd, Stage::lingering);
  guest.bytes = {};
  guest.deadline = Clock::now() + limit;
}

void GuestBook::drop(int fd) {
  const auto found = guests_.find(fd);
  line(found->second.stage).erase(found->second.place);
  const auto address = per_address_.find(found->second.peer.address);
  if (--address->second == 0) per_address_.erase(address);
  guests_.erase(found);
  ::close(fd);
}

Guest* GuestBook::find(int fd) {
  const auto found = guests_.find(fd);
  return found == guests_.end() ? nullptr : &found->second;
}

std::size_t GuestBook::from(const std::string& address) const {
  const auto found = per_address_.find(address);
  return found == per_address_.end() ? 0 : found->second;
}

int GuestBook::oldest(Stage stage) const {
  const std::list<int>& line = stage == Stage::reading ? reading_ : stage == Stage::serving ? serving_ : lingering_;
  return line.empty() ? -1 : line.front();
}

std::optional<GuestBook::Clock::time_point> GuestBook::next_deadline() const {
  std::optional<Clock::time_point> first;
  for (const Stage stage : {Stage::reading, Stage::lingering}) {
    const int fd = oldest(stage);
    if (fd < 0) continue;
    const Clock::time_point deadline = guests_.at(fd).deadline;
    first = first ? std::min(*first, deadline) : deadline;
  }
  return first;
}

}  // namespace kiln
