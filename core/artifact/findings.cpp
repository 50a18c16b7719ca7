#include "core/artifact/findings.h"

namespace kiln {

void Findings::fail(std::string code, std::string message, const std::string& place) {
  if (!fault_) fault_ = Fault{std::move(code), std::move(message), where(place)};
}

void Findings::warn(std::string code, std::string message, const std::string& place) {
  if (warnings_.size() < kMaxWarnings) {
    warnings_.push_back({std::move(code), std::move(message), where(place)});
  } else {
    ++more_warnings_;
  }
}

std::vector<Warning> Findings::warnings() const {
  std::vector<Warning> all = warnings_;
  if (more_warnings_ > 0) {
    all.push_back({"more_warnings", std::to_string(more_warnings_) + " more warnings are not listed.", file_});
  }
  return all;
}

}  // namespace kiln
