#pragma once
// A worker locks itself in before it looks at a byte of its input. For good: nothing opens the lock again.
//
//   files   Landlock: reads the system's libraries and `ranges/`, what others made of its bake, and writes `out/`
//           alone; its inputs are descriptors that it opened before
//   calls   seccomp: no sockets, no other programs, no child processes, no signals to others, no mounts, no tracing
//
// The order is fixed: PR_SET_NO_NEW_PRIVS, Landlock, seccomp. Either lock may be missing on a kernel (Landlock needs
// 5.13): the worker then runs with what there is, unless its order demands both.

#include <filesystem>

namespace kiln {

struct Sandbox {
  bool files = false;
  bool calls = false;
  bool whole() const { return files && calls; }
};

/// What this kernel offers. Changes nothing.
Sandbox sandbox_support();

/// Locks the calling process into `folder`. Call while it has one thread.
Sandbox enter_sandbox(const std::filesystem::path& folder);

}  // namespace kiln
