#pragma once
// One thing against another: tables of values, or artefacts, by the definition of core/bake/error_stats.h.

#include <string>

#include "client_cli/failure.h"
#include "client_cli/values.h"
#include "core/bake/error_stats.h"

namespace kiln {

struct Comparison {
  ErrorStats stats;
  std::size_t skipped = 0;   // points without a value on one side
  bool noise_known = false;  // the reference has standard errors, and their variance was subtracted
};

/// `column` is "irradiance" or "radiance". Row i of both must be the same point.
/// Fails  different_points: row and distance
Outcome<Comparison> compare_values(const ValueTable& a, const ValueTable& b, const std::string& column,
                                   std::uint64_t seed);

std::string comparison_text(const Comparison&);
std::string comparison_json(const Comparison&);

}  // namespace kiln
