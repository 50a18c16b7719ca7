#include "client_cli/value_output.h"

#include <algorithm>

#include "client_cli/files.h"

namespace kiln {
namespace {

constexpr double kFarShare = 0.01;  // of the scene's size: such a point was hardly meant to be on this surface

std::string of_points(std::ptrdiff_t some, std::size_t all) {
  return std::to_string(some) + " of " + std::to_string(all) + " points ";
}

}  // namespace

Outcome<ExitCode> write_values(const ValueTable& table, double scene_size, const std::string& output,
                               const Session& session) {
  const auto& values = table.values;
  const auto lost = std::count_if(values.begin(), values.end(), [](const auto& value) { return !has_value(value); });
  const auto far = std::count_if(values.begin(), values.end(),
                                 [&](const auto& value) { return value.distance > kFarShare * scene_size; });
  if (lost > 0)
    warn(session.terminal, of_points(lost, values.size()) + "have no surface with a compatible normal: nan");
  if (far > 0) warn(session.terminal, of_points(far, values.size()) + "lie more than 1 % of the scene's size off it");
  const Outcome<void> written = write_text(output, session.common.json ? values_json(table) : values_csv(table));
  if (!written) return tl::make_unexpected(written.error());
  return ExitCode::ok;
}

}  // namespace kiln
