#include "core/bake/json_fields.h"

#include <cmath>
#include <nlohmann/json.hpp>

namespace kiln {
namespace {

std::string range_text(const std::string& kind, const std::string& low, const std::string& high) {
  return kind + " from " + low + " to " + high;
}

std::string plain(double x) { return nlohmann::json(x).dump(); }

std::string escaped(const std::string& token) {  // RFC 6901
  std::string out;
  for (const char c : token) out += c == '~' ? "~0" : c == '/' ? "~1" : std::string(1, c);
  return out;
}

}  // namespace

std::string shown(const nlohmann::json& value) {
  std::string text = value.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
  if (text.size() > 80) text = text.substr(0, 77) + "...";
  return text;
}

JsonFields::JsonFields(const nlohmann::json& value, std::string pointer, std::vector<FieldError>& errors)
    : value_(value), pointer_(std::move(pointer)), errors_(errors) {
  if (!value_.is_object()) errors_.push_back({pointer_, "must be an object", shown(value_), "object"});
}

std::string JsonFields::pointer(const std::string& name) const { return pointer_ + "/" + escaped(name); }

bool JsonFields::has(const std::string& name) { return value_.is_object() && value_.contains(name); }

const nlohmann::json* JsonFields::find(const std::string& name, bool required) {
  known_.insert(name);
  if (has(name)) return &value_.at(name);
  if (required && value_.is_object()) errors_.push_back({pointer(name), "is required", "", ""});
  return nullptr;
}

void JsonFields::error(const std::string& name, std::string detail, std::string allowed) {
  errors_.push_back({pointer(name), std::move(detail), has(name) ? shown(value_.at(name)) : "", std::move(allowed)});
}

std::optional<double> JsonFields::number(const std::string& name, double low, double high) {
  const nlohmann::json* field = find(name);
  if (!field) return std::nullopt;
  const std::string allowed = range_text("a number", plain(low), plain(high));
  if (field->is_number()) {
    const double x = field->get<double>();
    if (std::isfinite(x) && x >= low && x <= high) return x;
  }
  error(name, "must be " + allowed, allowed);
  return std::nullopt;
}

std::optional<std::int64_t> JsonFields::integer(const std::string& name, std::int64_t low, std::int64_t high) {
  const nlohmann::json* field = find(name);
  if (!field) return std::nullopt;
  const std::string allowed = range_text("an integer", std::to_string(low), std::to_string(high));
  const bool too_big =
      field->is_number_unsigned() &&
      field->get<std::uint64_t>() > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  if (field->is_number_integer() && !too_big) {
    const auto x = field->get<std::int64_t>();
    if (x >= low && x <= high) return x;
  }
  error(name, "must be " + allowed, allowed);
  return std::nullopt;
}

std::optional<double> JsonFields::number_or_auto(const std::string& name, double low, double high) {
  const nlohmann::json* field = find(name);
  if (field && field->is_string() && field->get_ref<const std::string&>() == "auto") return std::nullopt;
  return number(name, low, high);
}

std::optional<std::int64_t> JsonFields::integer_or_auto(const std::string& name, std::int64_t low, std::int64_t high) {
  const nlohmann::json* field = find(name);
  if (field && field->is_string() && field->get_ref<const std::string&>() == "auto") return std::nullopt;
  if (field && field->is_string()) {
    const std::string allowed = "\"auto\" or " + range_text("an integer", std::to_string(low), std::to_string(high));
    error(name, "must be " + allowed, allowed);
    return std::nullopt;
  }
  return integer(name, low, high);
}

std::optional<bool> JsonFields::boolean(const std::string& name) {
  const nlohmann::json* field = find(name);
  if (!field) return std::nullopt;
  if (field->is_boolean()) return field->get<bool>();
  error(name, "must be true or false", "true, false");
  return std::nullopt;
}

std::optional<std::string> JsonFields::text(const std::string& name, std::size_t max_bytes) {
  const nlohmann::json* field = find(name);
  if (!field) return std::nullopt;
  if (field->is_string() && field->get_ref<const std::string&>().size() <= max_bytes) return field->get<std::string>();
  const std::string allowed = "a string of at most " + std::to_string(max_bytes) + " bytes";
  error(name, "must be " + allowed, allowed);
  return std::nullopt;
}

std::optional<std::size_t> JsonFields::word(const std::string& name, std::initializer_list<const char*> allowed) {
  const nlohmann::json* field = find(name);
  if (!field) return std::nullopt;
  std::string list;
  std::size_t index = 0;
  for (const char* candidate : allowed) {
    if (field->is_string() && field->get_ref<const std::string&>() == candidate) return index;
    list += (index++ == 0 ? "" : ", ") + std::string(candidate);
  }
  error(name, "must be one of: " + list, list);
  return std::nullopt;
}

void JsonFields::finish() {
  if (!value_.is_object()) return;
  for (const auto& [name, field] : value_.items()) {
    if (!known_.contains(name)) error(name, "is not a field of this object", "");
  }
}

}  // namespace kiln
