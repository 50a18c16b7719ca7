#pragma once
// Strict reading of one JSON object: a member of the wrong type is a fault that names its pointer, never a default.

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "core/artifact/findings.h"

namespace kiln {

/// A whole number in 0 .. 2^53, also when written as 3.0; -1 for anything else.
double whole_number(const nlohmann::json&);

/// A view of an object; `json` must outlive it. Absent members give the default.
class Fields {
 public:
  Fields(const nlohmann::json& json, std::string pointer, Findings& findings);

  bool has(const char* key) const;
  std::string pointer(const char* key) const { return pointer_ + "/" + key; }
  const std::string& pointer() const { return pointer_; }

  double number(const char* key, double absent) const;
  bool flag(const char* key, bool absent) const;
  std::string text(const char* key) const;
  /// A whole number in 0 .. 2^53.
  std::uint64_t count(const char* key, std::uint64_t absent) const;
  /// An index below `size`, or -1 if absent. Fails with index_out_of_range.
  int index(const char* key, std::size_t size) const;
  std::vector<int> indices(const char* key, std::size_t size) const;
  /// Exactly N numbers.
  template <std::size_t N>
  std::array<double, N> numbers(const char* key, std::array<double, N> absent) const {
    if (has(key)) read_numbers(key, absent.data(), N);
    return absent;
  }
  /// An object whose members are indices below `size`.
  std::map<std::string, int> index_map(const char* key, std::size_t size) const;

  /// The member object, or an empty one if absent.
  Fields object(const char* key) const;
  bool has_extension(const char* name) const;
  Fields extension(const char* name) const;
  std::vector<std::string> texts(const char* key) const;

  /// Number of elements of a member array, 0 if absent.
  std::size_t size(const char* key) const;
  /// Calls `each` for every object of a member array, until a fault.
  void for_each(const char* key, const std::function<void(const Fields&)>& each) const;

  Findings& findings() const { return *findings_; }

 private:
  const nlohmann::json* find(const char* key) const;
  void wrong_type(const std::string& place, const char* expected) const;
  void read_numbers(const char* key, double* out, std::size_t n) const;
  int as_index(const nlohmann::json& value, const std::string& place, std::size_t size) const;

  const nlohmann::json* json_;
  std::string pointer_;
  Findings* findings_;
};

}  // namespace kiln
