#include "core/artifact/json_scan.h"

#include <nlohmann/json.hpp>

namespace kiln {
namespace {

using Json = nlohmann::json;

/// Counts and stops early: every event returns false once something is too much.
class Scanner : public nlohmann::json_sax<Json> {
 public:
  Scanner(const JsonLimits& limits, Findings& findings) : limits_(limits), findings_(findings) {}

  bool null() override { return value(0); }
  bool boolean(bool) override { return value(0); }
  bool number_integer(number_integer_t) override { return value(0); }
  bool number_unsigned(number_unsigned_t) override { return value(0); }
  bool number_float(number_float_t, const string_t&) override { return value(0); }
  bool string(string_t& text) override { return value(32 + text.size()); }
  bool binary(binary_t&) override { return value(0); }
  bool key(string_t& name) override { return cost(80 + name.size()); }
  bool start_object(std::size_t) override { return open(); }
  bool start_array(std::size_t) override { return open(); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool parse_error(std::size_t byte, const std::string&, const Json::exception& error) override {
    constexpr int kNumberOutOfRange = 406;
    if (error.id == kNumberOutOfRange) {
      findings_.fail("number_out_of_range", "A number does not fit a double.", "byte " + std::to_string(byte));
    } else {
      findings_.fail("json_invalid", "The JSON is not well-formed.", "byte " + std::to_string(byte));
    }
    return false;
  }

 private:
  static constexpr std::size_t kCountedDepth = 2;  // inside the arrays of the root object

  bool value(std::size_t heap) { return element() && cost(24 + heap); }  // 16, and growth of the array

  bool open() {
    if (!element() || !cost(64)) return false;
    if (static_cast<int>(depth_) >= limits_.max_depth) {
      findings_.fail("json_too_deep", "JSON is nested deeper than " + std::to_string(limits_.max_depth) + " levels.");
      return false;
    }
    ++depth_;
    if (depth_ == kCountedDepth) elements_ = 0;
    return true;
  }
  bool close() {
    --depth_;
    return true;
  }
  bool element() {
    if (depth_ != kCountedDepth || ++elements_ <= limits_.max_objects) return true;
    return too_many("An array has more than " + std::to_string(limits_.max_objects) + " elements.");
  }
  bool cost(std::size_t bytes) {
    tree_bytes_ += bytes;
    if (tree_bytes_ <= limits_.max_tree_bytes) return true;
    return too_many("The JSON would take more than " + std::to_string(limits_.max_tree_bytes >> 20) +
                    " MiB of memory.");
  }
  bool too_many(std::string message) {
    findings_.fail("too_many_objects", std::move(message));
    return false;
  }

  JsonLimits limits_;
  Findings& findings_;
  std::size_t depth_ = 0;
  std::uint64_t elements_ = 0, tree_bytes_ = 0;
};

}  // namespace

void scan_json(std::span<const std::uint8_t> text, const JsonLimits& limits, Findings& findings) {
  if (text.size() > limits.max_bytes) {
    findings.fail("json_too_large", "The JSON has " + std::to_string(text.size()) + " bytes, more than " +
                                        std::to_string(limits.max_bytes) + ".");
    return;
  }
  Scanner scanner(limits, findings);
  if (!Json::sax_parse(text.begin(), text.end(), &scanner)) {
    findings.fail("json_invalid", "The JSON is not well-formed.");
  }
}

}  // namespace kiln
