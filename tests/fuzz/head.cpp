// The head of a request, the header fields with a grammar of their own, and the form behind the head if it has one.

#include <algorithm>

#include "server/api/header_fields.h"
#include "server/http/multipart.h"
#include "server/http/parse_head.h"
#include "tests/fuzz/target.h"

namespace kiln::fuzz {
namespace {

/// Gives seven bytes at a time, so that delimiters are cut everywhere.
class Pieces : public BodySource {
 public:
  explicit Pieces(std::string_view text) : text_(text) {}
  std::uint64_t length() const override { return text_.size(); }
  std::uint64_t taken() const override { return at_; }
  Answer<std::size_t> read(std::span<std::uint8_t> out) override {
    const std::size_t count = std::min({std::size_t{7}, out.size(), text_.size() - at_});
    std::copy_n(text_.data() + at_, count, out.data());
    at_ += count;
    return count;
  }

 private:
  std::string_view text_;
  std::size_t at_ = 0;
};

void check_fields(const Head& head) {
  for (const Field& field : head.fields) {
    promise(!field.name.empty() && field.value.find_first_of("\r\n") == std::string::npos);
    if (const auto range = parse_range(field.value, 1000)) promise(range->first <= range->last && range->last < 1000);
    if (const auto part = parse_content_range(field.value))
      promise(part->range.first <= part->range.last && part->range.last < part->total);
    (void)etag_listed(field.value, "\"e\"");
    (void)if_range_allows(field.value, "\"e\"");
    (void)prefer_wait(field.value);
    (void)parse_wait(field.value);
  }
}

void read_form(const Head& head, std::string_view body) {
  Pieces source(body);
  auto reader = MultipartReader::open(head, source);
  if (!reader) return;
  std::size_t bytes = 0;
  for (auto part = reader->next(); part && part->has_value(); part = reader->next()) {
    const auto text = read_part_text(*reader, 1000);
    if (!text) return;
    bytes += text->size();
  }
  promise(bytes <= body.size());
}

}  // namespace
}  // namespace kiln::fuzz

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kiln;
  const std::string_view text = fuzz::text_of(data, size);
  const std::size_t empty_line = text.find("\r\n\r\n");
  const std::size_t end = empty_line == std::string_view::npos ? size : empty_line + 4;
  const auto head = parse_head(text.substr(0, end));
  if (!head) {
    fuzz::promise(head.error().status >= 400 && !head.error().code.empty());
    return 0;
  }
  fuzz::promise(head->path.starts_with('/') && head->path.find('\0') == std::string::npos);
  (void)take_params(head->params, {"wait", "limit"});
  (void)parse_list_request(head->params);
  (void)parse_raw_request(head->params);
  fuzz::check_fields(*head);
  fuzz::read_form(*head, text.substr(end));
  return 0;
}
