#pragma once
// How far a bake is, on stderr: a bar that redraws itself on a terminal, else one line per 10 %.

#include <chrono>
#include <string>

#include "client_cli/terminal.h"
#include "core/base/progress.h"
#include "server/api/job.h"

namespace kiln {

/// Stage, percent, time to go and current error in one line of at most `width` columns.
std::string progress_line(const ProgressReply&, int width);

class ProgressBar {
 public:
  explicit ProgressBar(const Terminal&);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// An unknown time to go is estimated from the time that has passed.
  void update(ProgressReply);
  void update(const ProgressEvent&);
  /// Takes the bar off the screen, so that other talk can follow.
  void clear();

 private:
  Terminal terminal_;
  std::chrono::steady_clock::time_point start_, drawn_;
  int last_tenth_ = -1;
  bool visible_ = false;
};

}  // namespace kiln
