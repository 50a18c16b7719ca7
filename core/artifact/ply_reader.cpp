#include "core/artifact/ply_reader.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <sstream>
#include <utility>

namespace kiln {
namespace {

using Span = std::span<const std::uint8_t>;

constexpr std::size_t kMaxHeaderBytes = 64 * 1024;

std::optional<PlyType> type_named(const std::string& name) {
  constexpr std::array<std::pair<const char*, PlyType>, 16> kNames{{{"char", PlyType::i8},
                                                                    {"uchar", PlyType::u8},
                                                                    {"short", PlyType::i16},
                                                                    {"ushort", PlyType::u16},
                                                                    {"int", PlyType::i32},
                                                                    {"uint", PlyType::u32},
                                                                    {"float", PlyType::f32},
                                                                    {"double", PlyType::f64},
                                                                    {"int8", PlyType::i8},
                                                                    {"uint8", PlyType::u8},
                                                                    {"int16", PlyType::i16},
                                                                    {"uint16", PlyType::u16},
                                                                    {"int32", PlyType::i32},
                                                                    {"uint32", PlyType::u32},
                                                                    {"float32", PlyType::f32},
                                                                    {"float64", PlyType::f64}}};
  for (const auto& [text, type] : kNames) {
    if (name == text) return type;
  }
  return std::nullopt;
}

bool read_format(std::istringstream& words, PlyHeader& header) {
  std::string form, version;
  words >> form >> version;
  header.form = form == "ascii" ? PlyForm::ascii : form == "binary_big_endian" ? PlyForm::big : PlyForm::little;
  return version == "1.0" && (form == "ascii" || form == "binary_big_endian" || form == "binary_little_endian");
}

bool read_element(std::istringstream& words, PlyHeader& header) {
  PlyElement element;
  std::string count;
  words >> element.name >> count;
  const auto [end, error] = std::from_chars(count.data(), count.data() + count.size(), element.count);
  const bool again = std::ranges::find(header.elements, element.name, &PlyElement::name) != header.elements.end();
  header.elements.push_back(std::move(element));
  return !again && error == std::errc() && end == count.data() + count.size();
}

bool read_property(std::istringstream& words, PlyHeader& header) {
  if (header.elements.empty()) return false;
  PlyProperty property;
  std::string type;
  words >> type;
  if (type == "list") {
    std::string count;
    words >> count >> type;
    property.list = type_named(count);
    if (!property.list) return false;
  }
  words >> property.name;
  const auto value = type_named(type);
  property.type = value.value_or(PlyType::f32);
  header.elements.back().properties.push_back(property);
  return value && !property.name.empty();
}

/// One line of the header; false if it is not understood.
bool read_line(const std::string& line, PlyHeader& header) {
  std::istringstream words(line);
  std::string word;
  words >> word;
  if (word == "format") return read_format(words, header);
  if (word == "element") return read_element(words, header);
  if (word == "property") return read_property(words, header);
  return word == "comment" || word == "obj_info" || word == "ply" || word.empty();
}

/// The fewest bytes that an element can take.
std::uint64_t least_bytes(const PlyElement& e, PlyForm form) {
  std::uint64_t sum = 0;
  for (const PlyProperty& p : e.properties) sum += form == PlyForm::ascii ? 1 : ply_bytes(p.list.value_or(p.type));
  return std::max<std::uint64_t>(sum, 1);
}

void check_counts(const PlyHeader& header, std::uint64_t body, Findings& findings) {
  for (const PlyElement& e : header.elements) {
    if (e.properties.empty() && e.count > 0) continue;  // no data stands for it
    if (e.count <= body / least_bytes(e, header.form)) continue;
    findings.fail("ply_truncated",
                  "The header tells of more elements than the file has bytes for: " + std::to_string(e.count) + ".",
                  "header");
  }
}

}  // namespace

std::uint64_t ply_bytes(PlyType type) {
  switch (type) {
    case PlyType::i8:
    case PlyType::u8:
      return 1;
    case PlyType::i16:
    case PlyType::u16:
      return 2;
    case PlyType::f64:
      return 8;
    default:
      return 4;
  }
}

PlyHeader read_ply_header(Span file, Findings& findings) {
  PlyHeader header;
  bool has_format = false;
  std::size_t at = 0;
  for (int line_number = 1; at < std::min(file.size(), kMaxHeaderBytes); ++line_number) {
    std::string line;
    while (at < file.size() && file[at] != '\n') line += static_cast<char>(file[at++]);
    ++at;
    if (!line.empty() && line.back() == '\r') line.pop_back();
    has_format |= line.rfind("format", 0) == 0;
    if (line == "end_header") {
      header.bytes = std::min(at, file.size());
      if (!has_format) findings.fail("ply_invalid", "The header does not name a format.", "header");
      check_counts(header, file.size() - header.bytes, findings);
      return header;
    }
    if (!read_line(line, header)) {
      findings.fail("ply_invalid", "The header line is not understood, or names an element again.",
                    "line " + std::to_string(line_number));
      return header;
    }
  }
  findings.fail("ply_invalid", "The header has no end.", "header");
  return header;
}

std::optional<double> PlyNumbers::next_text() {
  const auto space = [](std::uint8_t c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; };
  while (!body_.empty() && space(body_.front())) body_ = body_.subspan(1);
  std::size_t length = 0;
  while (length < body_.size() && !space(body_[length])) ++length;
  const char* text = reinterpret_cast<const char*>(body_.data());
  double value = 0;
  const auto [end, error] = std::from_chars(text, text + length, value);
  body_ = body_.subspan(length);
  if (length == 0 || error != std::errc() || end != text + length) return std::nullopt;
  return value;
}

std::optional<std::uint64_t> PlyNumbers::next_count(PlyType type) {
  const auto count = next(type);
  const bool whole = count && *count >= 0 && *count <= static_cast<double>(left()) && *count == std::floor(*count);
  if (!whole) return std::nullopt;  // not a number among them
  return static_cast<std::uint64_t>(*count);
}

std::optional<double> PlyNumbers::next(PlyType type) {
  if (form_ == PlyForm::ascii) return next_text();
  const std::uint64_t size = ply_bytes(type);
  if (body_.size() < size) return std::nullopt;
  std::array<std::uint8_t, 8> bytes{};
  std::copy_n(body_.begin(), size, bytes.begin());
  if (form_ == PlyForm::big) std::reverse(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
  body_ = body_.subspan(size);
  const auto as = [&]<class T>(T) {
    T x;
    std::memcpy(&x, bytes.data(), sizeof x);
    return static_cast<double>(x);
  };
  static_assert(std::endian::native == std::endian::little);
  switch (type) {
    case PlyType::i8:
      return as(std::int8_t{});
    case PlyType::u8:
      return as(std::uint8_t{});
    case PlyType::i16:
      return as(std::int16_t{});
    case PlyType::u16:
      return as(std::uint16_t{});
    case PlyType::i32:
      return as(std::int32_t{});
    case PlyType::u32:
      return as(std::uint32_t{});
    case PlyType::f32:
      return as(float{});
    case PlyType::f64:
      return as(double{});
  }
  return std::nullopt;
}

}  // namespace kiln
