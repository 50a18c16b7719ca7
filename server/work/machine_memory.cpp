#include "server/work/machine_memory.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <string>

namespace kiln {
namespace {

constexpr std::uint64_t kUnbounded = std::numeric_limits<std::uint64_t>::max();

/// A number of bytes; "max", nonsense and a missing file are no bound.
std::uint64_t bound_in(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::uint64_t bytes = 0;
  return in >> bytes ? bytes : kUnbounded;
}

/// Of a group and those around it, up to the mount point.
std::uint64_t bound_of_group(const std::filesystem::path& mount, std::filesystem::path group, const char* file) {
  std::uint64_t least = bound_in(mount / file);
  for (group = group.relative_path(); !group.empty(); group = group.parent_path())
    least = std::min(least, bound_in(mount / group / file));
  return least;
}

std::uint64_t group_bound(const std::filesystem::path& root) {
  const std::filesystem::path mount = root / "sys/fs/cgroup";
  std::uint64_t least = kUnbounded;
  std::ifstream groups(root / "proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {  // hierarchy:controllers:path
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos) continue;
    const std::string controllers = "," + line.substr(first + 1, second - first - 1) + ",",
                      path = line.substr(second + 1);
    if (controllers == ",,") least = std::min(least, bound_of_group(mount, path, "memory.max"));
    if (controllers.find(",memory,") != std::string::npos)
      least = std::min(least, bound_of_group(mount / "memory", path, "memory.limit_in_bytes"));
  }
  return least;
}

}  // namespace

std::uint64_t machine_memory_mb(const std::filesystem::path& root) {
  const std::uint64_t machine =
      static_cast<std::uint64_t>(::sysconf(_SC_PHYS_PAGES)) * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
  return std::min(machine, group_bound(root)) >> 20;
}

}  // namespace kiln
