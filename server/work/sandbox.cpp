#include "server/work/sandbox.h"

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/landlock.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <vector>

namespace kiln {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kFilterCalls = false;  // sanitizers fork and trace themselves
#else
constexpr bool kFilterCalls = true;
#endif

#if defined(__x86_64__)
constexpr std::uint32_t kArchitecture = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr std::uint32_t kArchitecture = AUDIT_ARCH_AARCH64;
#else
constexpr std::uint32_t kArchitecture = 0;  // not written for: no filter
#endif

constexpr std::uint64_t kReadFile = LANDLOCK_ACCESS_FS_READ_FILE;
constexpr std::uint64_t kRead = kReadFile | LANDLOCK_ACCESS_FS_READ_DIR;
constexpr std::uint64_t kTruncate = 1ULL << 14;  // LANDLOCK_ACCESS_FS_TRUNCATE, newer than Debian 12's headers
constexpr std::uint64_t kWrite =
    kRead | LANDLOCK_ACCESS_FS_WRITE_FILE | LANDLOCK_ACCESS_FS_MAKE_REG | LANDLOCK_ACCESS_FS_REMOVE_FILE | kTruncate;
constexpr std::uint64_t kFirstRights = (1ULL << 13) - 1;  // those of the first version of Landlock

int landlock_version() {
  const long version = ::syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
  return version < 0 ? 0 : static_cast<int>(version);
}

/// Every right that this kernel can withhold.
std::uint64_t known_rights(int version) {
  std::uint64_t rights = kFirstRights;
  if (version >= 2) rights |= LANDLOCK_ACCESS_FS_REFER;
  if (version >= 3) rights |= kTruncate;
  return rights;
}

/// A closed descriptor at the end of its scope.
struct Descriptor {
  int number;
  ~Descriptor() {
    if (number >= 0) ::close(number);
  }
};

/// Gives rights below a path; a path that is not there needs none.
bool allow(int rules, const std::filesystem::path& path, std::uint64_t rights) {
  const Descriptor place{::open(path.c_str(), O_PATH | O_CLOEXEC)};
  if (place.number < 0) return errno == ENOENT;
  const landlock_path_beneath_attr below{rights, place.number};
  return ::syscall(SYS_landlock_add_rule, rules, LANDLOCK_RULE_PATH_BENEATH, &below, 0) == 0;
}

bool lock_files(const std::filesystem::path& folder) {
  const int version = landlock_version();
  if (version == 0) return false;
  const std::uint64_t known = known_rights(version);
  const landlock_ruleset_attr all{known};
  const Descriptor rules{static_cast<int>(::syscall(SYS_landlock_create_ruleset, &all, sizeof all, 0))};
  if (rules.number < 0) return false;
  bool allowed = allow(rules.number, folder / "out", kWrite & known) && allow(rules.number, folder / "ranges", kRead);
  // Libraries that are loaded late (TBB's allocator and topology), and what they ask about this machine.
  for (const char* path : {"/usr", "/lib", "/lib64", "/sys/devices/system", "/proc/self"}) {
    allowed = allowed && allow(rules.number, path, (kRead | LANDLOCK_ACCESS_FS_EXECUTE) & known);
  }
  for (const char* path : {"/etc/ld.so.cache", "/dev/null", "/dev/urandom"}) {
    allowed = allowed && allow(rules.number, path, kReadFile);
  }
  return allowed && ::syscall(SYS_landlock_restrict_self, rules.number, 0) == 0;
}

/// The filter's program: falls through to "allow".
class CallFilter {
 public:
  CallFilter() {
    load(offsetof(seccomp_data, arch));
    jump(BPF_JEQ, kArchitecture, 1, 0);
    code_.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS));
    load(offsetof(seccomp_data, nr));
    jump(BPF_JGE, 0x40000000U, 0, 1);  // the x32 calls of x86-64, an old way round filters
    refuse(EPERM);
  }
  void deny(long call, int error = EPERM) {
    jump(BPF_JEQ, static_cast<std::uint32_t>(call), 0, 1);
    refuse(error);
  }
  /// Denies the call unless its first argument, under `mask`, is `wanted`.
  void deny_unless(long call, std::uint32_t mask, std::uint32_t wanted) {
    jump(BPF_JEQ, static_cast<std::uint32_t>(call), 0, 5);
    load(offsetof(seccomp_data, args));
    code_.push_back(BPF_STMT(BPF_ALU | BPF_AND | BPF_K, mask));
    jump(BPF_JEQ, wanted, 1, 0);
    refuse(EPERM);
    load(offsetof(seccomp_data, nr));
  }
  bool install() {
    code_.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW));
    const sock_fprog program{static_cast<unsigned short>(code_.size()), code_.data()};
    return ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
  }

 private:
  void load(std::size_t offset) {
    code_.push_back(BPF_STMT(BPF_LD | BPF_W | BPF_ABS, static_cast<std::uint32_t>(offset)));
  }
  void jump(int test, std::uint32_t value, unsigned char if_true, unsigned char if_false) {
    code_.push_back(BPF_JUMP(static_cast<unsigned short>(BPF_JMP | test | BPF_K), value, if_true, if_false));
  }
  void refuse(int error) {
    code_.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | static_cast<std::uint32_t>(error)));
  }
  std::vector<sock_filter> code_;
};

bool filter_calls() {
  if (kArchitecture == 0 || !kFilterCalls) return false;
  CallFilter filter;
  for (const long call :
       {SYS_socket, SYS_socketpair, SYS_connect, SYS_bind, SYS_listen, SYS_accept, SYS_accept4, SYS_execve,
        SYS_execveat, SYS_ptrace, SYS_process_vm_readv, SYS_process_vm_writev, SYS_mount, SYS_umount2, SYS_pivot_root,
        SYS_chroot, SYS_unshare, SYS_setns, SYS_bpf, SYS_perf_event_open, SYS_userfaultfd, SYS_io_uring_setup,
        SYS_keyctl, SYS_add_key, SYS_request_key, SYS_init_module, SYS_finit_module, SYS_delete_module, SYS_kexec_load,
        SYS_open_by_handle_at, SYS_kill, SYS_tkill, SYS_rt_sigqueueinfo, SYS_rt_tgsigqueueinfo, SYS_pidfd_send_signal,
        SYS_pidfd_getfd,
        // Landlock has no say in these, and the inputs are the store's own blobs.
        SYS_truncate, SYS_fchmod, SYS_fchmodat, SYS_fchown, SYS_fchownat, SYS_utimensat, SYS_setxattr, SYS_lsetxattr,
        SYS_fsetxattr, SYS_removexattr, SYS_lremovexattr, SYS_fremovexattr}) {
    filter.deny(call);
  }
#ifdef SYS_chmod  // architectures with a past
  for (const long call : {SYS_chmod, SYS_chown, SYS_lchown, SYS_utime, SYS_utimes, SYS_futimesat}) filter.deny(call);
#endif
#ifdef SYS_fchmodat2
  filter.deny(SYS_fchmodat2);
#else
  filter.deny(452);  // the same number everywhere; newer than Debian 12's headers
#endif
#ifdef SYS_fork
  filter.deny(SYS_fork);
  filter.deny(SYS_vfork);
#endif
  filter.deny(SYS_clone3, ENOSYS);  // its flags are out of a filter's sight; libc falls back to clone
  filter.deny_unless(SYS_clone, CLONE_THREAD, CLONE_THREAD);
  filter.deny_unless(SYS_tgkill, 0xFFFFFFFFU, static_cast<std::uint32_t>(::getpid()));
  filter.deny_unless(SYS_prlimit64, 0xFFFFFFFFU, 0);
  return filter.install();
}

}  // namespace

Sandbox sandbox_support() {
  // GET_SECCOMP answers 0 where filters can be installed and EINVAL where they are not compiled in.
  const bool filters = kArchitecture != 0 && kFilterCalls && ::prctl(PR_GET_SECCOMP) >= 0;
  return {landlock_version() > 0, filters};
}

Sandbox enter_sandbox(const std::filesystem::path& folder) {
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return {};
  Sandbox sandbox;
  sandbox.files = lock_files(folder);
  sandbox.calls = filter_calls();
  return sandbox;
}

}  // namespace kiln
