#include "client_cli/terminal.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <nlohmann/json.hpp>

namespace kiln {
namespace {

constexpr const char* kRed = "\033[31m";
constexpr const char* kYellow = "\033[33m";
constexpr const char* kPlain = "\033[0m";

bool is_set(const char* name) {
  const char* value = std::getenv(name);
  return value && *value;
}

int terminal_width() {
  winsize size{};
  return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 20 ? size.ws_col : 80;
}

void show_marked(const Terminal& terminal, const char* color, const char* mark, const std::string& sentence) {
  std::fprintf(stderr, "kiln: %s%s%s %s\n", terminal.color ? color : "", mark, terminal.color ? kPlain : "",
               sentence.c_str());
}

void show_field_error(const FieldError& error) {
  std::fprintf(stderr, "  %s: %s", error.pointer.empty() ? "/" : error.pointer.c_str(), error.detail.c_str());
  if (!error.received.empty()) std::fprintf(stderr, "; received %s", error.received.c_str());
  if (!error.allowed.empty()) std::fprintf(stderr, "; allowed: %s", error.allowed.c_str());
  std::fputc('\n', stderr);
}

/// A problem document; in place of an HTTP status it has the exit code.
std::string failure_json(const Failure& failure) {
  auto document = nlohmann::json::parse(problem_json(failure.problem));
  document.erase("status");
  document["exit_code"] = static_cast<int>(failure.exit);
  return document.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

Terminal detect_terminal(bool json) {
  Terminal terminal;
  const char* kind = std::getenv("TERM");
  terminal.interactive = isatty(STDERR_FILENO) == 1 && !(kind && std::strcmp(kind, "dumb") == 0);
  terminal.color = terminal.interactive && !is_set("NO_COLOR");
  terminal.width = terminal_width();
  terminal.json = json;
  return terminal;
}

void say(const std::string& sentence) { std::fprintf(stderr, "kiln: %s\n", sentence.c_str()); }

void warn(const Terminal& terminal, const std::string& sentence) {
  show_marked(terminal, kYellow, "warning:", sentence);
}

void show_failure(const Terminal& terminal, const Failure& failure) {
  const Problem& problem = failure.problem;
  if (terminal.json) {
    std::fprintf(stderr, "%s\n", failure_json(failure).c_str());
    return;
  }
  const std::string place = problem.where.empty() ? "" : problem.where + ": ";
  show_marked(terminal, kRed,
              "error:", place + problem.detail + (problem.code.empty() ? "" : " [" + problem.code + "]"));
  for (const FieldError& error : problem.errors) show_field_error(error);
  if (!problem.request_id.empty()) std::fprintf(stderr, "  request %s\n", problem.request_id.c_str());
}

std::string human_bytes(double bytes) {
  static constexpr const char* kUnits[] = {"B", "kB", "MB", "GB", "TB"};
  int unit = 0;
  while (bytes >= 999.5 && unit < 4) {
    bytes /= 1000;
    ++unit;
  }
  char text[32];
  std::snprintf(text, sizeof text, unit == 0 || bytes >= 99.95 ? "%.0f %s" : "%.1f %s", bytes, kUnits[unit]);
  return text;
}

std::string percent_text(double share) {
  char text[32];
  std::snprintf(text, sizeof text, std::abs(share) < 1 ? "%.3g %%" : "%.0f %%", 100 * share);
  return text;
}

std::string human_seconds(double seconds) {
  char text[48];
  const auto whole = static_cast<long long>(std::llround(std::max(seconds, 0.0)));
  if (seconds < 10) {
    std::snprintf(text, sizeof text, "%.1f s", std::max(seconds, 0.0));
  } else if (whole < 60) {
    std::snprintf(text, sizeof text, "%lld s", whole);
  } else if (whole < 3600) {
    std::snprintf(text, sizeof text, "%lld min %lld s", whole / 60, whole % 60);
  } else {
    std::snprintf(text, sizeof text, "%lld h %lld min", whole / 3600, whole % 3600 / 60);
  }
  return text;
}

}  // namespace kiln
