#pragma once
// report.json and plans as text for people.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client_cli/failure.h"

namespace kiln {

/// The decisions of a plan with their reasons, predictions and warnings. Works for plans and reports.
std::string plan_text(std::string_view json);

/// What the input has and the bake did not honour, a sentence each.
std::vector<std::string> report_warnings(std::string_view report_json);

/// "error 1.2 % (95 % interval 1.0 .. 1.5 %), ..." of a report's certificate, and how far a reduced model is off; empty
/// when it has neither.
std::string certificate_text(std::string_view report_json);

/// What became of a promised error or time, and where the error comes from; empty when nothing was promised.
std::string promise_text(std::string_view report_json);

/// False only where a promise was made and could not be kept.
bool promise_kept(std::string_view report_json);

/// relRMSE of a report's certificate, or of its grid's where that is larger; nothing when it has none.
std::optional<double> certified_error(std::string_view report_json);

}  // namespace kiln
