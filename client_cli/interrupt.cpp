#include "client_cli/interrupt.h"

#include <signal.h>
#include <sys/socket.h>

#include <atomic>

#include "core/base/expects.h"

namespace kiln {
namespace {

/// What the handler may touch: lock-free atomics only.
struct HandlerData {
  std::atomic<bool> alive{false}, raised{false};
  std::atomic<Threads*> threads{nullptr};
  std::atomic<int> socket{-1};
};

HandlerData& handler_data() {
  static HandlerData data;
  return data;
}

void on_signal(int) {
  HandlerData& data = handler_data();
  data.raised.store(true);
  if (Threads* threads = data.threads.load()) threads->stop();
  if (const int socket = data.socket.load(); socket >= 0) shutdown(socket, SHUT_RDWR);
}

}  // namespace

Interrupt::Interrupt() {
  EXPECTS(!handler_data().alive.exchange(true));
  handler_data().raised.store(false);
  struct sigaction action {};
  action.sa_handler = on_signal;
  action.sa_flags = static_cast<int>(SA_RESETHAND);  // a second signal ends the program
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

Interrupt::~Interrupt() {
  struct sigaction action {};
  action.sa_handler = SIG_DFL;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  stop_threads(nullptr);
  shut_socket(-1);
  handler_data().alive.store(false);
}

void Interrupt::stop_threads(Threads* threads) { handler_data().threads.store(threads); }
void Interrupt::shut_socket(int descriptor) { handler_data().socket.store(descriptor); }
bool Interrupt::raised() const { return handler_data().raised.load(); }

}  // namespace kiln
