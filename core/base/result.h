#pragma once
// What can go wrong in the world is a value: Result<T> holds a T or a Fault that a caller can act on.

#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace kiln {

/// One thing that went wrong outside of us, told so that its owner can mend it.
struct Fault {
  std::string code;     // stable, snake_case: "accessor_out_of_bounds"; becomes the problem type
  std::string message;  // one sentence for a person; no path of this machine, no library text
  std::string where;    // the place: "scene.glb: /meshes/3/primitives/0/indices element 812"; may be empty
};

template <class T>
using Result = tl::expected<T, Fault>;

inline tl::unexpected<Fault> fault(std::string code, std::string message, std::string where = {}) {
  return tl::make_unexpected(Fault{std::move(code), std::move(message), std::move(where)});
}

}  // namespace kiln

/// Leaves the function with the fault of `expr` if there is one, else names its value `name`.
#define KILN_TRY(name, expr)                                             \
  auto name##_result = (expr);                                           \
  if (!name##_result) return tl::make_unexpected(name##_result.error()); \
  auto name = std::move(*name##_result)
