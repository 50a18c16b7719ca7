#pragma once
// What reading a file has brought to light: its first fault, and warnings. Readers go on with defaults after a fault
// and are asked at the end of a stage, so that they stay readable.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/scene/scene.h"

namespace kiln {

class Findings {
 public:
  /// `file` is the name that places start with, as in "scene.glb: /meshes/3".
  explicit Findings(std::string file) : file_(std::move(file)) {}

  /// Keeps the first fault only.
  void fail(std::string code, std::string message, const std::string& place = {});
  /// Keeps at most kMaxWarnings; the last one then says how many more there were.
  void warn(std::string code, std::string message, const std::string& place = {});

  bool failed() const { return fault_.has_value(); }
  const Fault& fault() const { return *fault_; }
  std::vector<Warning> warnings() const;

  static constexpr std::size_t kMaxWarnings = 100;

 private:
  std::string where(const std::string& place) const {
    return place.empty() ? file_ : file_.empty() ? place : file_ + ": " + place;
  }

  std::string file_;
  std::optional<Fault> fault_;
  std::vector<Warning> warnings_;
  std::uint64_t more_warnings_ = 0;
};

}  // namespace kiln
