#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "core/artifact/gltf_schema.h"
#include "core/artifact/gltf_tree.h"
#include "core/artifact/json_fields.h"

namespace kiln::gltf {
namespace {

using Json = nlohmann::json;

constexpr double kMaxReal = 1e30;
constexpr auto kMaxInt = static_cast<double>(std::numeric_limits<std::int32_t>::max());
constexpr std::size_t kMaxModelBytes = 256u << 20;

/// Sizes of the arrays that indices refer to.
std::map<std::string, std::size_t, std::less<>> array_sizes(const Json& root) {
  std::map<std::string, std::size_t, std::less<>> out;
  if (!root.is_object()) return out;
  for (const auto& [name, value] : root.items()) {
    if (value.is_array()) out[name] = value.size();
  }
  const Json::json_pointer lights("/extensions/KHR_lights_punctual/lights");
  out["lights"] = root.contains(lights) && root.at(lights).is_array() ? root.at(lights).size() : 0;
  return out;
}

class TreeCheck {
 public:
  TreeCheck(const Json& root, Findings& findings) : sizes_(array_sizes(root)), findings_(findings) {}

  void object(Json& value, const Kind& kind, const std::string& place) {
    if (!expect(value.is_object(), "an object", place)) return;
    take(kind.model_bytes, place);
    remove_unlisted(value, kind);
    for (const Member& m : kind.members) {
      if (findings_.failed()) return;
      const auto at = value.find(m.name);
      if (at != value.end()) {
        member(*at, m, place + "/" + std::string(m.name));
      } else if (m.required) {
        findings_.fail("property_missing", "The property \"" + std::string(m.name) + "\" is required.", place);
      }
    }
  }

 private:
  bool expect(bool holds, std::string_view what, const std::string& place) {
    if (holds) return true;
    findings_.fail("json_type", "The value must be " + std::string(what) + ".", place.empty() ? "/" : place);
    return false;
  }

  /// tinygltf's structs are up to 184 times as long as the JSON "{}" that makes one.
  void take(std::size_t bytes, const std::string& place) {
    model_bytes_ += bytes;
    if (model_bytes_ > kMaxModelBytes) {
      findings_.fail(
          "too_many_objects",
          "The objects up to here would take more than " + std::to_string(kMaxModelBytes >> 20) + " MiB of memory.",
          place);
    }
  }

  static void remove_unlisted(Json& value, const Kind& kind) {
    for (auto at = value.begin(); at != value.end();) {
      const bool listed =
          std::any_of(kind.members.begin(), kind.members.end(), [&](const Member& m) { return m.name == at.key(); });
      at = listed ? std::next(at) : value.erase(at);
    }
  }

  void member(Json& value, const Member& m, const std::string& place) {
    switch (m.is) {
      case Is::flag:
        expect(value.is_boolean(), "true or false", place);
        return;
      case Is::text:
        expect(value.is_string(), "a string", place);
        return;
      case Is::word:
        return word(value, m, place);
      case Is::real:
        return real(value, kMaxReal, place, place);
      case Is::whole:
      case Is::small_whole:
      case Is::value_whole:
      case Is::code:
        return whole(value, m, place);
      case Is::index:
        return index(value, m, place);
      case Is::index_map:
        return index_map(value, m, place);
      case Is::numbers:
      case Is::reals:
        return numbers(value, m, place);
      case Is::bounds:
        return bounds(value, place);
      case Is::object:
        return object(value, *m.kind, place);
      default:
        return array(value, m, place);
    }
  }

  void word(const Json& value, const Member& m, const std::string& place) {
    if (!expect(value.is_string(), "a string", place)) return;
    if (std::find(m.words.begin(), m.words.end(), value.get_ref<const std::string&>()) != m.words.end()) return;
    findings_.fail("unknown_enum", "The value of \"" + std::string(m.name) + "\" is not one that glTF knows.", place);
  }

  /// Written with a point from here on: in an extension tinygltf narrows all others to int.
  void real(Json& value, double limit, const std::string& place, const std::string& large_place) {
    if (!expect(value.is_number(), "a number", place)) return;
    value = value.get<double>();
    if (std::abs(value.get<double>()) > limit) too_large(large_place);
  }

  void too_large(const std::string& place) { findings_.fail("number_out_of_range", "The number is too large.", place); }

  void whole(Json& value, const Member& m, const std::string& place) {
    const double x = whole_number(value);
    if (!expect(x >= 0, "a whole number that is not negative", place)) return;
    if (m.is == Is::code && std::none_of(m.codes.begin(), m.codes.end(), [&](int c) { return c == x; })) {
      findings_.fail("unknown_enum", "The value of \"" + std::string(m.name) + "\" is not one that glTF knows.", place);
    }
    if (m.is == Is::small_whole && x > kMaxInt) too_large(place);
    if (m.is == Is::value_whole) {
      value = x;
    } else {
      value = static_cast<std::uint64_t>(x);
    }
  }

  void index(Json& value, const Member& m, const std::string& place) {
    const double x = whole_number(value);
    if (!expect(x >= 0, "an index", place)) return;
    const auto at = sizes_.find(m.of);
    const double size = m.of.empty() ? kMaxInt : at == sizes_.end() ? 0 : static_cast<double>(at->second);
    if (x >= size) {
      findings_.fail("index_out_of_range",
                     "Index " + std::to_string(static_cast<std::uint64_t>(x)) +
                         " >= " + std::to_string(static_cast<std::uint64_t>(size)) + ".",
                     place);
    }
    value = static_cast<std::uint64_t>(x);
  }

  void index_map(Json& value, const Member& m, const std::string& place) {
    if (!expect(value.is_object(), "an object", place)) return;
    take(value.size() * kNamedValueBytes, place);
    for (auto& [name, element] : value.items()) {
      // tinygltf ends a name at its first NUL: two attributes would become one.
      expect(name.find('\0') == std::string::npos, "named without NUL characters", place);
      if (!findings_.failed()) index(element, m, place + "/" + name);
    }
  }

  void numbers(Json& value, const Member& m, const std::string& place) {
    if (!value.is_array() || value.size() != m.count) {
      expect(false, "an array of " + std::to_string(m.count) + " numbers", place);
      return;
    }
    const double limit = m.is == Is::reals ? kMaxReal : std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < value.size(); ++i) real(value[i], limit, place + "/" + std::to_string(i), place);
  }

  void bounds(Json& value, const std::string& place) {
    if (!expect(value.is_array(), "an array", place)) return;
    if (value.size() == 3) return numbers(value, {.is = Is::numbers, .count = 3}, place);
    value = Json::array();
  }

  void array(Json& value, const Member& m, const std::string& place) {
    if (!expect(value.is_array(), "an array", place) || m.is == Is::list) return;
    for (std::size_t i = 0; i < value.size() && !findings_.failed(); ++i) {
      const std::string element = place + "/" + std::to_string(i);
      if (m.is == Is::objects) object(value[i], *m.kind, element);
      if (m.is == Is::indices) index(value[i], m, element);
      if (m.is == Is::texts) expect(value[i].is_string(), "a string", element);
    }
  }

  std::map<std::string, std::size_t, std::less<>> sizes_;
  Findings& findings_;
  std::size_t model_bytes_ = 0;
};

}  // namespace

void check_tree(Json& root, Findings& findings) { TreeCheck(root, findings).object(root, document_kind(), ""); }

}  // namespace kiln::gltf
