#pragma once
// What must hold on entry. A broken promise is our own bug: it ends the job, never the server.

#include <stdexcept>

namespace kiln {

struct ContractViolation : std::logic_error {
  using std::logic_error::logic_error;
};

[[noreturn]] void contract_violation(const char* condition, const char* file, int line);

}  // namespace kiln

#define EXPECTS(condition) \
  ((condition) ? static_cast<void>(0) : ::kiln::contract_violation(#condition, __FILE__, __LINE__))
