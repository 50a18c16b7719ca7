#include "core/artifact/json_fields.h"

#include <cmath>
#include <nlohmann/json.hpp>

namespace kiln {
namespace {

const nlohmann::json& empty_object() {
  static const nlohmann::json empty = nlohmann::json::object();
  return empty;
}

}  // namespace

double whole_number(const nlohmann::json& value) {
  if (!value.is_number()) return -1;
  const auto x = value.get<double>();
  return x >= 0 && x <= 0x1p53 && x == std::floor(x) ? x : -1;
}

Fields::Fields(const nlohmann::json& json, std::string pointer, Findings& findings)
    : json_(&json), pointer_(std::move(pointer)), findings_(&findings) {
  if (json.is_object()) return;
  wrong_type(pointer_, "an object");
  json_ = &empty_object();
}

const nlohmann::json* Fields::find(const char* key) const {
  const auto at = json_->find(key);
  return at == json_->end() ? nullptr : &*at;
}

bool Fields::has(const char* key) const { return find(key) != nullptr; }

void Fields::wrong_type(const std::string& place, const char* expected) const {
  findings_->fail("json_type", std::string("The value must be ") + expected + ".", place.empty() ? "/" : place);
}

double Fields::number(const char* key, double absent) const {
  const auto* value = find(key);
  if (!value) return absent;
  if (value->is_number()) return value->get<double>();
  wrong_type(pointer(key), "a number");
  return absent;
}

bool Fields::flag(const char* key, bool absent) const {
  const auto* value = find(key);
  if (!value) return absent;
  if (value->is_boolean()) return value->get<bool>();
  wrong_type(pointer(key), "true or false");
  return absent;
}

std::string Fields::text(const char* key) const {
  const auto* value = find(key);
  if (!value) return {};
  if (value->is_string()) return value->get<std::string>();
  wrong_type(pointer(key), "a string");
  return {};
}

std::uint64_t Fields::count(const char* key, std::uint64_t absent) const {
  const auto* value = find(key);
  if (!value) return absent;
  const double x = whole_number(*value);
  if (x >= 0) return static_cast<std::uint64_t>(x);
  wrong_type(pointer(key), "a whole number that is not negative");
  return absent;
}

int Fields::as_index(const nlohmann::json& value, const std::string& place, std::size_t size) const {
  const double x = whole_number(value);
  if (x >= 0 && x < static_cast<double>(size)) return static_cast<int>(x);
  if (x < 0) {
    wrong_type(place, "an index");
  } else {
    findings_->fail("index_out_of_range",
                    "Index " + std::to_string(static_cast<std::uint64_t>(x)) + " >= " + std::to_string(size) + ".",
                    place);
  }
  return -1;
}

int Fields::index(const char* key, std::size_t size) const {
  const auto* value = find(key);
  return value ? as_index(*value, pointer(key), size) : -1;
}

std::vector<int> Fields::indices(const char* key, std::size_t size) const {
  std::vector<int> out;
  const auto* value = find(key);
  if (!value) return out;
  if (!value->is_array()) wrong_type(pointer(key), "an array");
  if (!value->is_array()) return out;
  for (const auto& element : *value) {
    out.push_back(as_index(element, pointer(key) + "/" + std::to_string(out.size()), size));
    if (findings_->failed()) return {};
  }
  return out;
}

void Fields::read_numbers(const char* key, double* out, std::size_t n) const {
  const auto* value = find(key);
  if (!value->is_array() || value->size() != n) {
    return wrong_type(pointer(key), ("an array of " + std::to_string(n) + " numbers").c_str());
  }
  for (std::size_t i = 0; i < n; ++i) {
    if (!(*value)[i].is_number()) return wrong_type(pointer(key) + "/" + std::to_string(i), "a number");
    out[i] = (*value)[i].get<double>();
  }
}

std::map<std::string, int> Fields::index_map(const char* key, std::size_t size) const {
  std::map<std::string, int> out;
  const Fields map = object(key);
  for (const auto& [name, value] : map.json_->items()) out[name] = as_index(value, map.pointer_ + "/" + name, size);
  return out;
}

Fields Fields::object(const char* key) const {
  const auto* value = find(key);
  return {value ? *value : empty_object(), pointer(key), *findings_};
}

bool Fields::has_extension(const char* name) const { return has("extensions") && object("extensions").has(name); }

Fields Fields::extension(const char* name) const { return object("extensions").object(name); }

std::vector<std::string> Fields::texts(const char* key) const {
  std::vector<std::string> out;
  const auto* value = find(key);
  if (!value) return out;
  if (!value->is_array()) wrong_type(pointer(key), "an array");
  if (!value->is_array()) return out;
  for (const auto& element : *value) {
    if (element.is_string()) {
      out.push_back(element.get<std::string>());
    } else {
      wrong_type(pointer(key) + "/" + std::to_string(out.size()), "a string");
    }
  }
  return out;
}

std::size_t Fields::size(const char* key) const {
  const auto* value = find(key);
  if (!value) return 0;
  if (value->is_array()) return value->size();
  wrong_type(pointer(key), "an array");
  return 0;
}

void Fields::for_each(const char* key, const std::function<void(const Fields&)>& each) const {
  const auto* value = find(key);
  if (size(key) == 0) return;
  std::size_t i = 0;
  for (const auto& element : *value) {
    each({element, pointer(key) + "/" + std::to_string(i++), *findings_});
    if (findings_->failed()) return;
  }
}

}  // namespace kiln
