#include "tests/bench/trade/child.h"

#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>

namespace kiln::trade {
namespace {

constexpr int kFault = 3;  // exit code: the text is a fault's code and message

bool write_all(int to, const std::string& text) {
  for (std::size_t at = 0; at < text.size();) {
    const ssize_t n = ::write(to, text.data() + at, text.size() - at);
    if (n < 0 && errno != EINTR) return false;
    if (n > 0) at += static_cast<std::size_t>(n);
  }
  return true;
}

std::string read_all(int from) {
  std::string out;
  std::array<char, 4096> part{};
  for (;;) {
    const ssize_t n = ::read(from, part.data(), part.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return out;
    out.append(part.data(), static_cast<std::size_t>(n));
  }
}

[[noreturn]] void be_the_child(int to, const std::function<Result<std::string>()>& work) {
  int code = kFault;
  std::string text;
  try {
    const Result<std::string> result = work();
    code = result ? 0 : kFault;
    text = result ? *result : result.error().code + "\n" + result.error().message;
  } catch (const std::exception& e) {
    text = std::string("exception\n") + e.what();
  }
  if (!write_all(to, text)) code = 1;
  ::_exit(code);  // destructors and buffers belong to the parent
}

}  // namespace

Result<std::string> in_child(const std::function<Result<std::string>()>& work) {
  int ends[2];
  std::fflush(nullptr);
  if (::pipe(ends) != 0) return fault("child_died", "no pipe could be made");
  const pid_t child = ::fork();
  if (child < 0) return fault("child_died", "no process could be made");
  if (child == 0) {
    ::close(ends[0]);
    be_the_child(ends[1], work);
  }
  ::close(ends[1]);
  std::string text = read_all(ends[0]);
  ::close(ends[0]);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return text;
  if (WIFEXITED(status) && WEXITSTATUS(status) == kFault) {
    const std::size_t end = text.find('\n');
    return fault(text.substr(0, end), end == std::string::npos ? "" : text.substr(end + 1));
  }
  return fault("child_died", "the process of the run ended by itself");
}

}  // namespace kiln::trade
