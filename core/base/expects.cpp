#include "core/base/expects.h"

#include <cstring>
#include <string>

namespace kiln {

void contract_violation(const char* condition, const char* file, int line) {
  const char* name = std::strrchr(file, '/');
  throw ContractViolation(std::string("expected ") + condition + " at " + (name ? name + 1 : file) + ":" +
                          std::to_string(line));
}

}  // namespace kiln
