#pragma once
// Talk goes to stderr, in one voice: "kiln: ..." with colour only where a person looks.

#include <string>

#include "client_cli/failure.h"

namespace kiln {

struct Terminal {
  bool interactive = false;  // stderr is a terminal: a progress bar may redraw its line
  bool color = false;        // interactive, and neither NO_COLOR nor TERM=dumb
  int width = 80;
  bool json = false;  // failures as one JSON object per line
};

Terminal detect_terminal(bool json);

void say(const std::string& sentence);
void warn(const Terminal&, const std::string& sentence);

/// The failure, its place, and every single mistake with its pointer.
void show_failure(const Terminal&, const Failure&);

/// 1234567 -> "1.2 MB".
std::string human_bytes(double bytes);
/// 75 -> "1 min 15 s".
std::string human_seconds(double seconds);
/// "1.23 %" of .0123; whole numbers from 100 % on.
std::string percent_text(double share);

}  // namespace kiln
