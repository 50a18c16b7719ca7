// What a worker that was taken over could still do. Each question is asked in a child that locked itself in.

#include "server/work/sandbox.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <sys/xattr.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <functional>
#include <string>
#include <thread>

namespace kiln {
namespace {

class SandboxTest : public ::testing::Test {
 protected:
  SandboxTest() {
    std::string name = (std::filesystem::temp_directory_path() / "kiln_sandbox.XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
    std::filesystem::create_directories(folder_ / "inputs");
    std::filesystem::create_directories(folder_ / "out");
    std::ofstream(folder_ / "inputs" / "0") << "scene";
  }
  ~SandboxTest() override { std::filesystem::remove_all(folder_); }
  void SetUp() override {
    if (!sandbox_support().whole()) GTEST_SKIP() << "this kernel (or a sanitizer) has not both Landlock and seccomp";
  }

  /// 0 when `act` succeeded in the sandbox, else its errno. `act` returns like a system call.
  int try_inside(const std::function<long()>& act) const {
    const pid_t child = ::fork();
    if (child == 0) {
      if (!enter_sandbox(folder_).whole()) ::_exit(255);
      errno = 0;
      ::_exit(act() >= 0 ? 0 : errno);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
  }
  int try_open(const std::filesystem::path& path, int flags) const {
    return try_inside([&] { return ::open(path.c_str(), flags, 0600); });
  }

  std::filesystem::path folder_;
};

TEST_F(SandboxTest, AWorkerReadsItsInputsByWhatItOpenedBeforeAndWritesItsResults) {
  const int input = ::open((folder_ / "inputs" / "0").c_str(), O_RDONLY | O_CLOEXEC);
  char first = 0;
  EXPECT_EQ(try_inside([&] { return ::pread(input, &first, 1, 0) == 1 && first == 's' ? 0 : -1; }), 0);
  EXPECT_EQ(try_open(folder_ / "inputs" / "0", O_RDONLY), EACCES);
  for (const int flags : {O_RDONLY, O_RDWR})
    EXPECT_EQ(try_open("/proc/self/fd/" + std::to_string(input), flags), EACCES);
  ::close(input);
  EXPECT_EQ(try_open(folder_ / "out" / "scene.glb", O_WRONLY | O_CREAT | O_EXCL), 0);
}

TEST_F(SandboxTest, AWorkerReadsNothingElse) {
  EXPECT_EQ(try_open("/etc/passwd", O_RDONLY), EACCES);
  EXPECT_EQ(try_open(folder_.parent_path(), O_RDONLY | O_DIRECTORY), EACCES);
  EXPECT_EQ(try_open(folder_ / "inputs" / ".." / ".." / "other", O_RDONLY | O_CREAT), EACCES);
}

TEST_F(SandboxTest, AWorkerCannotChangeItsInputsWhichAreTheStoresOwnBlobs) {
  EXPECT_EQ(try_open(folder_ / "inputs" / "0", O_WRONLY), EACCES);
  EXPECT_EQ(try_open(folder_ / "inputs" / "1", O_WRONLY | O_CREAT), EACCES);
  const std::string from = folder_ / "inputs" / "0", to = folder_ / "out" / "0";
  EXPECT_NE(try_inside([&] { return ::link(from.c_str(), to.c_str()); }), 0);
  EXPECT_NE(try_inside([&] { return ::rename(from.c_str(), to.c_str()); }), 0);
  EXPECT_NE(try_inside([&] { return ::truncate(from.c_str(), 0); }), 0);
  EXPECT_EQ(std::filesystem::file_size(folder_ / "inputs" / "0"), 5U);
}

TEST_F(SandboxTest, AWorkerCannotMakeItsInputsUnreadableNorOlder) {
  const std::string input = folder_ / "inputs" / "0";
  EXPECT_EQ(try_inside([&] { return ::chmod(input.c_str(), 0); }), EPERM);
  EXPECT_EQ(try_inside([&] { return ::fchmodat(AT_FDCWD, input.c_str(), 0, 0); }), EPERM);
  EXPECT_EQ(try_inside([&] { return ::syscall(452, AT_FDCWD, input.c_str(), 0, 0); }), EPERM) << "fchmodat2";
  EXPECT_EQ(try_inside([&] { return ::fchmod(::open(input.c_str(), O_RDONLY), 0); }), EPERM);
  EXPECT_EQ(try_inside([&] { return ::chown(input.c_str(), ::getuid(), ::getgid()); }), EPERM);
  EXPECT_EQ(try_inside([&] { return ::utimensat(AT_FDCWD, input.c_str(), nullptr, 0); }), EPERM);
  EXPECT_EQ(try_inside([&] { return ::setxattr(input.c_str(), "user.a", "b", 1, 0); }), EPERM);
}

TEST_F(SandboxTest, AWorkerHasNoNetworkNoOtherProgramsAndNoChildren) {
  EXPECT_EQ(try_inside([] { return ::socket(AF_INET, SOCK_STREAM, 0); }), EPERM);
  EXPECT_EQ(try_inside([] { return ::socket(AF_UNIX, SOCK_STREAM, 0); }), EPERM);
  EXPECT_EQ(try_inside([] { return ::execl("/bin/true", "true", nullptr); }), EPERM);
  EXPECT_EQ(try_inside([] { return ::fork(); }), EPERM);
}

TEST_F(SandboxTest, AWorkerCannotSignalTheServer) {
  EXPECT_EQ(try_inside([] { return ::kill(::getppid(), 0); }), EPERM);
  EXPECT_EQ(try_inside([] { return ::tgkill(::getppid(), ::getppid(), 0); }), EPERM);
  EXPECT_EQ(try_inside([] { return ::tgkill(::getpid(), ::gettid(), 0); }), 0) << "abort() needs this";
}

TEST_F(SandboxTest, ThreadsStillStart) {
  EXPECT_EQ(try_inside([] {
              int ran = -1;
              std::thread([&ran] { ran = 0; }).join();
              return ran;
            }),
            0);
}

}  // namespace
}  // namespace kiln
