#pragma once
// One accepted connection in the hands of a worker thread: reads and writes that never wait for ever.

#include <chrono>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "server/http/message.h"

namespace kiln {

/// How slow a peer may be, in either direction.
struct Pace {
  std::chrono::milliseconds idle{10'000};   // longest pause between two bytes
  std::chrono::milliseconds grace{10'000};  // after this the average rate counts
  double bytes_per_s = 1024;                // smallest average rate, over the time spent waiting
};

/// A non-blocking socket with some bytes read ahead. Does not own the descriptor: the front closes it.
class Connection : public Sink {
 public:
  Connection(int fd, std::string read_ahead, Pace pace);

  /// Some bytes; 0 when the peer has closed. Problem `timeout` when it is too slow.
  Answer<std::size_t> read(std::span<std::uint8_t> out);
  /// All of `bytes`; false when the peer is gone or too slow.
  bool write(std::string_view bytes) override;
  bool client_gone() override;
  std::uint64_t bytes_written() const { return sent_.bytes; }

 private:
  struct Account {
    std::uint64_t bytes = 0;
    std::chrono::steady_clock::duration waited{0};
  };
  bool wait(short events, Account& account);

  int fd_;
  std::string read_ahead_;
  std::size_t read_ahead_used_ = 0;
  Pace pace_;
  Account received_, sent_;
};

/// The body that a head announces, read from its connection.
class ConnectionBody : public BodySource {
 public:
  /// `expects_continue`: the client waits for 100 Continue before it sends.
  ConnectionBody(Connection& connection, std::uint64_t length, bool expects_continue)
      : connection_(&connection), length_(length), expects_continue_(expects_continue) {}
  std::uint64_t length() const override { return length_; }
  std::uint64_t taken() const override { return taken_; }
  Answer<std::size_t> read(std::span<std::uint8_t> out) override;
  /// All of it was taken: the connection may be closed without lingering.
  bool drained() const { return taken_ == length_; }

 private:
  Connection* connection_;
  std::uint64_t length_;
  std::uint64_t taken_ = 0;
  bool expects_continue_;
};

}  // namespace kiln
