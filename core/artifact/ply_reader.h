#pragma once
// The syntax of PLY: header and a stream of numbers.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/artifact/findings.h"

namespace kiln {

enum class PlyType { i8, u8, i16, u16, i32, u32, f32, f64 };
std::uint64_t ply_bytes(PlyType);

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::f32;
  std::optional<PlyType> list;  // type of the count, if it is a list
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;
};

enum class PlyForm { ascii, little, big };

struct PlyHeader {
  PlyForm form = PlyForm::ascii;
  std::vector<PlyElement> elements;
  std::size_t bytes = 0;  // where the body starts
};

/// Fails with ply_invalid. Element counts are checked against the bytes that are left.
PlyHeader read_ply_header(std::span<const std::uint8_t> file, Findings&);

/// The numbers of the body, in order.
class PlyNumbers {
 public:
  PlyNumbers(std::span<const std::uint8_t> body, PlyForm form) : body_(body), form_(form) {}
  /// Nothing at the end of the file or where no number stands.
  std::optional<double> next(PlyType);
  /// The next number as the length of a list: nothing where it is none that the rest of the file can hold.
  std::optional<std::uint64_t> next_count(PlyType);
  std::uint64_t left() const { return body_.size(); }

 private:
  std::optional<double> next_text();

  std::span<const std::uint8_t> body_;
  PlyForm form_;
};

}  // namespace kiln
