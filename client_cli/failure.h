#pragma once
// Why a command could not do its work: a problem to show and the exit code that goes with it.

#include <string>
#include <type_traits>
#include <utility>

#include "client_cli/exit_code.h"
#include "core/base/result.h"
#include "server/api/problem.h"

namespace kiln {

struct Failure {
  ExitCode exit = ExitCode::error;
  Problem problem;
};

template <class T>
using Outcome = tl::expected<T, Failure>;

inline tl::unexpected<Failure> fail(ExitCode exit, std::string code, std::string detail, std::string where = {}) {
  Failure failure{exit, {}};
  failure.problem.code = std::move(code);
  failure.problem.detail = std::move(detail);
  failure.problem.where = std::move(where);
  return tl::make_unexpected(std::move(failure));
}

/// A fault of a file that the user gave: its exit code is `rejected`, or `not_found` where there is no such file.
Failure failure_of(const Fault&);
/// A problem that the server answered with: 404 is not_found, 400, 413, 415 and 422 are rejected, others are errors.
Failure failure_of(const Problem&);
/// All mistakes of a recipe.
Failure failure_of(std::vector<FieldError>);

template <class T>
Outcome<T> or_failure(Result<T> result) {
  if (!result) return tl::make_unexpected(failure_of(result.error()));
  if constexpr (std::is_void_v<T>) {
    return {};
  } else {
    return std::move(*result);
  }
}

}  // namespace kiln
