#pragma once
// Reading a JSON object field by field: every mistake is noted with its pointer, none is silently replaced.

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <limits>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/bake/recipe.h"

namespace kiln {

/// One JSON object being read. Fields that nobody asked for are reported by finish().
class JsonFields {
 public:
  JsonFields(const nlohmann::json& value, std::string pointer, std::vector<FieldError>& errors);

  bool has(const std::string& name);
  /// The field's value, or nothing when it is absent (a missing required field is an error).
  const nlohmann::json* find(const std::string& name, bool required = false);

  std::optional<double> number(const std::string& name, double low, double high);
  /// As number, but "auto" counts as absent.
  std::optional<double> number_or_auto(const std::string& name, double low, double high);
  std::optional<std::int64_t> integer(const std::string& name, std::int64_t low, std::int64_t high);
  /// As integer, but "auto" counts as absent.
  std::optional<std::int64_t> integer_or_auto(const std::string& name, std::int64_t low, std::int64_t high);
  std::optional<bool> boolean(const std::string& name);
  std::optional<std::string> text(const std::string& name, std::size_t max_bytes);
  /// The index of the word among `allowed`.
  std::optional<std::size_t> word(const std::string& name, std::initializer_list<const char*> allowed);

  void error(const std::string& name, std::string detail, std::string allowed);
  std::string pointer(const std::string& name) const;
  void finish();

 private:
  const nlohmann::json& value_;
  std::string pointer_;
  std::vector<FieldError>& errors_;
  std::set<std::string> known_;
};

/// Compact text of a value for an error, at most 80 bytes.
std::string shown(const nlohmann::json& value);

}  // namespace kiln
