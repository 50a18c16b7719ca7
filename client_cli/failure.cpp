#include "client_cli/failure.h"

namespace kiln {

Failure failure_of(const Fault& fault) {
  Failure failure{ExitCode::rejected, {}};
  if (fault.code == "not_found" || fault.code == "file_not_found") failure.exit = ExitCode::not_found;
  if (fault.code == "internal") failure.exit = ExitCode::error;
  failure.problem.code = fault.code;
  failure.problem.detail = fault.message;
  failure.problem.where = fault.where;
  return failure;
}

Failure failure_of(const Problem& problem) {
  Failure failure{ExitCode::error, problem};
  const int status = problem.status;
  if (status == 404) failure.exit = ExitCode::not_found;
  if (status == 400 || status == 413 || status == 415 || status == 422) failure.exit = ExitCode::rejected;
  return failure;
}

Failure failure_of(std::vector<FieldError> errors) {
  Failure failure{ExitCode::rejected, {}};
  failure.problem.code = "invalid_recipe";
  failure.problem.detail =
      "the recipe has " + std::to_string(errors.size()) + (errors.size() == 1 ? " mistake" : " mistakes");
  failure.problem.errors = std::move(errors);
  return failure;
}

}  // namespace kiln
