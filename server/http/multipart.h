#pragma once
// multipart/form-data (RFC 7578), part by part and in bounded memory.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "server/http/message.h"

namespace kiln {

struct PartHead {
  std::string name;
  std::string filename;  // empty: a plain field
};

class MultipartReader {
 public:
  /// Fails  malformed_multipart when Content-Type has no usable boundary.
  static Answer<MultipartReader> open(const Head& head, BodySource& body);

  /// The next part, whatever was left of the one before it skipped; nothing after the last.
  Answer<std::optional<PartHead>> next();
  /// Bytes of the present part; 0 at its end.
  Answer<std::size_t> read(std::span<std::uint8_t> out);

 private:
  MultipartReader(BodySource& body, std::string delimiter) : body_(&body), delimiter_(std::move(delimiter)) {}
  Answer<bool> fill();
  Answer<std::string> read_part_head();
  Answer<bool> after_delimiter();

  BodySource* body_;
  std::string delimiter_;        // CR LF -- boundary
  std::string buffer_ = "\r\n";  // so that the first delimiter looks like every other
  bool in_part_ = false;
  bool started_ = false;
  int parts_ = 0;
};

/// All of the present part as text, refused as too_large beyond `limit` bytes.
Answer<std::string> read_part_text(MultipartReader&, std::size_t limit);

}  // namespace kiln
