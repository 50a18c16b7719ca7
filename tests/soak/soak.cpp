// kiln_soak: the faults and loads that take minutes to hours; ctest runs short ones. Loopback and temporary folders
// only.
//   kiln_soak kills sqlite|postgres CYCLES
//   kiln_soak stale ROUNDS
//   kiln_soak crowd sqlite|postgres CLIENTS SLOW UPLOADS
//   kiln_soak steady SECONDS
//   kiln_soak split MODEL.glb|pit SAMPLES SHARE_S
// Exit 0: every promise held; 1: a line says which did not, or why the run could not go on; 77: no PostgreSQL here.

#include "tests/soak/soak.h"

#include <signal.h>
#include <sys/resource.h>

#include <cstdlib>
#include <stdexcept>
#include <string_view>

namespace kiln::testing {
namespace {

int usage() {
  std::fputs(
      "kiln_soak kills sqlite|postgres CYCLES | stale ROUNDS | crowd sqlite|postgres CLIENTS SLOW UPLOADS |\n"
      "          steady SECONDS | split MODEL.glb|pit SAMPLES SHARE_S\n",
      stderr);
  return 2;
}

/// Two descriptors for each connection: ours and the server's, which inherits the limit.
void allow_many_descriptors() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  static_cast<void>(::setrlimit(RLIMIT_NOFILE, &limit));
}

int count_of(const char* text) {
  const int count = std::atoi(text);
  if (count <= 0) throw std::invalid_argument("a count above 0 is wanted");
  return count;
}

int run(const std::vector<std::string>& words) {
  if (words.size() < 2) return usage();
  const std::string& what = words[0];
  const bool chosen = (what == "kills" || what == "crowd") && words[1] == "postgres";
  const bool postgres = chosen || what == "stale" || what == "split";
  if (postgres && postgres_programs().empty()) {
    std::puts("skipped: the package postgresql is not installed");
    return 77;
  }
  Breaches breaches;
  if (what == "kills" && words.size() == 3) {
    run_kills({postgres, count_of(words[2].c_str())}, breaches);
  } else if (what == "stale" && words.size() == 2) {
    run_stale({count_of(words[1].c_str())}, breaches);
  } else if (what == "crowd" && words.size() == 5) {
    run_crowd({postgres, count_of(words[2].c_str()), count_of(words[3].c_str()), count_of(words[4].c_str())}, breaches);
  } else if (what == "steady" && words.size() == 2) {
    run_steady({count_of(words[1].c_str())}, breaches);
  } else if (what == "split" && words.size() == 4) {
    run_split({words[1], count_of(words[2].c_str()), std::atof(words[3].c_str())}, breaches);
  } else {
    return usage();
  }
  return breaches.count() == 0 ? 0 : 1;
}

}  // namespace
}  // namespace kiln::testing

int main(int argc, char** argv) {
  ::signal(SIGPIPE, SIG_IGN);
  ::setenv("PGPASSWORD", kiln::testing::PostgresServer::kPassword, 1);
  kiln::testing::allow_many_descriptors();
  ::setvbuf(stdout, nullptr, _IOLBF, 0);
  try {
    return kiln::testing::run({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    std::printf("ended early: %s\n", error.what());
    return 1;
  }
}
