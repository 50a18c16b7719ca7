#include "client_cli/progress_bar.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace kiln {
namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kRedraw = std::chrono::milliseconds(80);
constexpr double kEarly = 0.02;  // below this fraction elapsed time says nothing about the rest

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

std::string bar(double fraction, int cells) {
  const auto full = static_cast<int>(std::lround(std::clamp(fraction, 0.0, 1.0) * cells));
  return "[" + std::string(static_cast<std::size_t>(full), '#') +
         std::string(static_cast<std::size_t>(cells - full), '.') + "]";
}

}  // namespace

std::string progress_line(const ProgressReply& progress, int width) {
  char percent[16];
  std::snprintf(percent, sizeof percent, "%3d %%", static_cast<int>(std::clamp(progress.fraction, 0.0, 1.0) * 100));
  std::string line = std::string(percent) + "  " + progress.stage;
  if (progress.eta_s) line += "  ETA " + human_seconds(*progress.eta_s);
  if (progress.error) {
    char error[32];
    std::snprintf(error, sizeof error, "  error %.2g", *progress.error);
    line += error;
  }
  return line.substr(0, static_cast<std::size_t>(std::max(width, 1)));
}

ProgressBar::ProgressBar(const Terminal& terminal) : terminal_(terminal), start_(Clock::now()) {}

ProgressBar::~ProgressBar() { clear(); }

void ProgressBar::clear() {
  if (visible_) std::fputs("\r\033[K", stderr);
  visible_ = false;
}

void ProgressBar::update(ProgressReply progress) {
  if (!progress.eta_s && progress.fraction > kEarly) {
    progress.eta_s = seconds_since(start_) * (1 - progress.fraction) / progress.fraction;
  }
  if (terminal_.interactive) {
    if (visible_ && Clock::now() - drawn_ < kRedraw) return;
    drawn_ = Clock::now();
    visible_ = true;
    const int cells = std::clamp(terminal_.width / 4, 8, 30);
    const std::string line = bar(progress.fraction, cells) + " " + progress_line(progress, terminal_.width - cells - 4);
    std::fprintf(stderr, "\r%s\033[K", line.c_str());
    std::fflush(stderr);
    return;
  }
  const int tenth = static_cast<int>(std::clamp(progress.fraction, 0.0, 1.0) * 10);
  if (tenth <= last_tenth_) return;
  last_tenth_ = tenth;
  std::fprintf(stderr, "%s\n", progress_line(progress, 200).c_str());
}

void ProgressBar::update(const ProgressEvent& event) {
  ProgressReply progress;
  progress.stage = event.stage;
  progress.done = event.done;
  progress.total = event.total;
  progress.fraction = event.fraction;
  progress.error = event.error;
  update(progress);
}

}  // namespace kiln
