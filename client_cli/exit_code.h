#pragma once
// What the program tells its caller when it ends. contract.md section 2.

namespace kiln {

enum class ExitCode : int {
  ok = 0,
  error = 1,
  usage = 2,
  job_failed = 3,
  canceled = 4,
  not_found = 5,
  unreachable = 6,
  rejected = 7,       // the input or the recipe is at fault
  target_missed = 8,  // an error is above what was asked for
  interrupted = 130,
};

}  // namespace kiln
