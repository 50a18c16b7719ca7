#include "client_cli/comparison.h"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "client_cli/terminal.h"

namespace kiln {
namespace {

constexpr double kSamePoint = 1e-5;  // of the extent of all points: what a CSV of seven digits keeps

double extent_of(const std::vector<QueryPoint>& points) {
  Vec3d low = points[0].position, high = low;
  for (const QueryPoint& point : points) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], point.position[axis]);
      high[axis] = std::max(high[axis], point.position[axis]);
    }
  }
  const Vec3d far{std::max(std::abs(low.x), std::abs(high.x)), std::max(std::abs(low.y), std::abs(high.y)),
                  std::max(std::abs(low.z), std::abs(high.z))};
  return std::max(length(high - low), length(far));
}

Outcome<void> check_same_points(const ValueTable& a, const ValueTable& b) {
  if (a.points.size() != b.points.size()) {
    return fail(ExitCode::rejected, "different_points",
                "A has " + std::to_string(a.points.size()) + " points and B has " + std::to_string(b.points.size()));
  }
  if (a.points.empty()) return fail(ExitCode::rejected, "different_points", "there are no points to compare");
  const double tolerance = kSamePoint * extent_of(a.points);
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    if (length(a.points[i].position - b.points[i].position) <= tolerance) continue;
    return fail(ExitCode::rejected, "different_points", "point " + std::to_string(i + 1) + " of A is not that of B");
  }
  return {};
}

}  // namespace

Outcome<Comparison> compare_values(const ValueTable& a, const ValueTable& b, const std::string& column,
                                   std::uint64_t seed) {
  const Outcome<void> same = check_same_points(a, b);
  if (!same) return tl::make_unexpected(same.error());
  const bool radiance = column == "radiance";
  const auto value = [&](const LightValue& v) { return radiance ? v.radiance : v.irradiance; };
  const auto error = [&](const LightValue& v) { return radiance ? v.radiance_error : v.irradiance_error; };
  std::vector<Vec3d> values, reference, noise;
  Comparison out;
  out.noise_known = b.has_errors;
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    if (!has_value(a.values[i]) || !has_value(b.values[i])) {
      ++out.skipped;
      continue;
    }
    values.push_back(value(a.values[i]));
    reference.push_back(value(b.values[i]));
    Vec3d variance;
    if (a.has_errors) variance += error(a.values[i]) * error(a.values[i]);
    if (b.has_errors) variance += error(b.values[i]) * error(b.values[i]);
    noise.push_back(variance);
  }
  if (values.empty()) return fail(ExitCode::rejected, "no_values", "no point has a value on both sides");
  out.stats = compute_error({values, reference, noise, values.size()}, {.seed = seed});
  return out;
}

std::string comparison_text(const Comparison& c) {
  const ErrorStats& s = c.stats;
  std::string out = "relRMSE            " + percent_text(s.relrmse) + "   (95 % interval " +
                    percent_text(s.interval_low) + " .. " + percent_text(s.interval_high) + ")\n";
  out += "without worst 1 %  " + percent_text(s.relrmse_without_worst_1pct) + "\n";
  out += "99th percentile    " + percent_text(s.p99) + "\n";
  out += "maximum            " + percent_text(s.max) + "\n";
  out += "bias               " + percent_text(s.bias) + "\n";
  out += "points             " + std::to_string(s.points);
  if (c.skipped > 0) out += "   (" + std::to_string(c.skipped) + " more have no value on one side)";
  out += "\n";
  out += c.noise_known ? "reference noise    " + percent_text(s.noise) + ", subtracted\n"
                       : "reference noise    unknown, taken as none\n";
  if (s.dark_lightings > 0) out += "lit by nothing     error 0 by definition\n";
  return out;
}

std::string comparison_json(const Comparison& c) {
  const ErrorStats& s = c.stats;
  const nlohmann::json out = {{"relrmse", s.relrmse},
                              {"interval", {s.interval_low, s.interval_high}},
                              {"relrmse_without_worst_1pct", s.relrmse_without_worst_1pct},
                              {"p99", s.p99},
                              {"max", s.max},
                              {"bias", s.bias},
                              {"points", s.points},
                              {"skipped", c.skipped},
                              {"noise", c.noise_known ? nlohmann::json(s.noise) : nlohmann::json()},
                              {"dark", s.dark_lightings > 0}};
  return out.dump() + "\n";
}

}  // namespace kiln
