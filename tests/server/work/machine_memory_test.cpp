#include "server/work/machine_memory.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <string>

namespace kiln {
namespace {

/// A machine's files in a folder of their own.
class MachineMemory : public ::testing::Test {
 protected:
  MachineMemory() {
    std::string name = (std::filesystem::temp_directory_path() / "kiln_machine_XXXXXX").string();
    root_ = ::mkdtemp(name.data());
  }
  ~MachineMemory() override { std::filesystem::remove_all(root_); }
  void write(const std::string& file, const std::string& text) const {
    std::filesystem::create_directories((root_ / file).parent_path());
    std::ofstream(root_ / file) << text << '\n';
  }
  std::uint64_t mb() const { return machine_memory_mb(root_); }

  std::filesystem::path root_;
};

TEST_F(MachineMemory, IsThatOfTheMachineWhereNothingBoundsIt) {
  const std::uint64_t machine = mb();
  EXPECT_EQ(machine, static_cast<std::uint64_t>(::sysconf(_SC_PHYS_PAGES)) *
                             static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE)) >>
                         20);
  write("proc/self/cgroup", "0::/service");
  write("sys/fs/cgroup/service/memory.max", "max");
  EXPECT_EQ(mb(), machine);
}

TEST_F(MachineMemory, IsBoundedByTheGroupAndByThoseAroundIt) {
  write("proc/self/cgroup", "0::/system.slice/kilnd.service");
  write("sys/fs/cgroup/system.slice/kilnd.service/memory.max", "536870912");
  EXPECT_EQ(mb(), 512U);
  write("sys/fs/cgroup/system.slice/memory.max", "268435456");
  EXPECT_EQ(mb(), 256U);
  write("sys/fs/cgroup/memory.max", "134217728");  // a container sees its own group as the root
  EXPECT_EQ(mb(), 128U);
}

TEST_F(MachineMemory, VersionOneCountsWhereMemoryIsAmongTheControllers) {
  write("proc/self/cgroup", "9:cpu,cpuacct:/a\n8:memory:/b\n1:name=systemd:/c");
  write("sys/fs/cgroup/memory/a/memory.limit_in_bytes", "1048576");
  write("sys/fs/cgroup/memory/b/memory.limit_in_bytes", "268435456");
  EXPECT_EQ(mb(), 256U);
  write("sys/fs/cgroup/memory/b/memory.limit_in_bytes", "9223372036854771712");  // what it says for none
  EXPECT_GT(mb(), 256U);
}

}  // namespace
}  // namespace kiln
