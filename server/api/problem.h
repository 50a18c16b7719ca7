#pragma once
// What went wrong, as application/problem+json (RFC 9457): one shape for every error of the service.

#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "core/bake/recipe.h"
#include "core/base/result.h"

namespace kiln {

inline constexpr const char* kProblemType = "application/problem+json";
inline constexpr const char* kProblemBase = "https://kiln.invalid/problems/";

/// An error for the other side of the wire. `detail` is ours: never a path, never a library's text.
struct Problem {
  std::string code;  // stable, snake_case; `type` is kProblemBase + code, `title` the code in words
  int status = 500;
  std::string detail;
  std::string request_id;
  std::string where;               // place inside the user's own file; may be empty
  std::vector<FieldError> errors;  // every mistake of a rejected document
};

template <class T>
using Answer = tl::expected<T, Problem>;

/// The HTTP status of a code. A code that the table does not know speaks about the input: 422.
int status_of_code(std::string_view code);

/// A problem whose status is that of its code.
Problem make_problem(std::string code, std::string detail, std::vector<FieldError> errors = {});
Problem problem_of(const Fault&);
inline tl::unexpected<Problem> refuse(std::string code, std::string detail, std::vector<FieldError> errors = {}) {
  return tl::make_unexpected(make_problem(std::move(code), std::move(detail), std::move(errors)));
}

std::string problem_title(std::string_view code);
std::string problem_json(const Problem&);

/// Reads a problem from any RFC 9457 document; members that are missing or of another type stay empty.
/// Fails  code `not_a_problem` when `json` is no JSON object.
Result<Problem> parse_problem(std::string_view json);

}  // namespace kiln
