#include "client_cli/bake_result.h"

#include <filesystem>
#include <nlohmann/json.hpp>

#include "client_cli/files.h"
#include "client_cli/report_text.h"

namespace kiln {
namespace {

using nlohmann::json;

std::string files_json(const BakedFiles& files) {
  json out = {{"folder", files.folder}, {"files", files.names}};
  const json report = json::parse(files.report, nullptr, false);
  out["certificate"] = report.is_object() && report.contains("certificate") ? report["certificate"] : json();
  out["warnings"] = report.is_object() && report.contains("warnings") ? report["warnings"] : json::array();
  return out.dump() + "\n";
}

std::string files_text(const BakedFiles& files) {
  std::string out;
  for (const std::string& name : files.names) out += (std::filesystem::path(files.folder) / name).string() + "\n";
  return out;
}

Outcome<ExitCode> check_error(const std::string& report, double max_error) {
  const auto error = certified_error(report);
  if (!error) return fail(ExitCode::target_missed, "no_certificate", "the bake has no certificate to check");
  if (*error <= max_error) return ExitCode::ok;
  return fail(ExitCode::target_missed, "error_above_limit", "the certified error is above --max-error");
}

}  // namespace

std::string output_folder(const std::string& output, const std::string& input) {
  if (!output.empty()) return output;
  return std::filesystem::path(input).stem().string() + "-baked";
}

Outcome<ExitCode> show_bake(const BakedFiles& files, std::optional<double> max_error, const Session& session) {
  const Outcome<void> written = write_text("", session.common.json ? files_json(files) : files_text(files));
  if (!written) return tl::make_unexpected(written.error());
  for (const std::string& warning : report_warnings(files.report)) warn(session.terminal, warning);
  if (const std::string certificate = certificate_text(files.report); !certificate.empty()) say(certificate);
  if (const std::string promise = promise_text(files.report); !promise.empty()) say(promise);
  if (!promise_kept(files.report)) return ExitCode::target_missed;
  return max_error ? check_error(files.report, *max_error) : Outcome<ExitCode>(ExitCode::ok);
}

}  // namespace kiln
