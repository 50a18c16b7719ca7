#pragma once
// Ctrl-C. The first one asks the work to stop; a second one ends the program at once.

#include "core/base/threads.h"

namespace kiln {

/// Catches SIGINT and SIGTERM while it lives. Only one may live at a time: a signal handler has no other way to find
/// its data than a static place, which is in interrupt.cpp and nowhere else.
class Interrupt {
 public:
  Interrupt();
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  /// Stops these threads on a signal; nullptr: none. See StopTogether.
  void stop_threads(Threads*);
  /// Shuts this socket down on a signal, so that a blocking read returns. -1: none.
  void shut_socket(int descriptor);
  bool raised() const;
};

/// While it lives, a signal stops `threads`.
class StopTogether {
 public:
  StopTogether(Interrupt& interrupt, Threads& threads) : interrupt_(interrupt) { interrupt_.stop_threads(&threads); }
  ~StopTogether() { interrupt_.stop_threads(nullptr); }
  StopTogether(const StopTogether&) = delete;
  StopTogether& operator=(const StopTogether&) = delete;

 private:
  Interrupt& interrupt_;
};

}  // namespace kiln
