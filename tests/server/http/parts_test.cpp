// The pieces below the routes: heads, escapes, forms.

#include <gtest/gtest.h>

#include <algorithm>

#include "core/base/random.h"
#include "server/http/multipart.h"
#include "server/http/parse_head.h"

namespace kiln {
namespace {

class Text : public BodySource {
 public:
  Text(std::string text, std::size_t piece) : text_(std::move(text)), piece_(piece) {}
  std::uint64_t length() const override { return text_.size(); }
  std::uint64_t taken() const override { return at_; }
  Answer<std::size_t> read(std::span<std::uint8_t> out) override {
    const std::size_t count = std::min({piece_, out.size(), text_.size() - at_});
    std::copy_n(text_.data() + at_, count, out.data());
    at_ += count;
    return count;
  }

 private:
  std::string text_;
  std::size_t piece_, at_ = 0;
};

Head form_head(const std::string& type) {
  Head head;
  head.fields.push_back({"content-type", type});
  return head;
}

TEST(ParseHead, DecodesPathAndQuery) {
  const auto head = parse_head("GET /a%20b/%C3%A9?x=1+2&y=%26&z HTTP/1.1\r\nHost: h\r\nAccept:  a \r\n\r\n");
  ASSERT_TRUE(head.has_value());
  EXPECT_EQ(head->path, "/a b/\xC3\xA9");
  EXPECT_EQ(head->params, (QueryParams{{"x", "1 2"}, {"y", "&"}, {"z", ""}}));
  EXPECT_EQ(field_of(*head, "accept"), "a");
}

TEST(ParseHead, WhateverIsAcceptedHasOnePathOneLengthAndNoControlBytes) {
  const std::string good =
      "PUT /v1/jobs?preset=prt&label=%C3%A9 HTTP/1.1\r\nHost: a\r\nContent-Length: 12\r\nX-Y: z%20\r\nRange: "
      "bytes=0-1\r\n\r\n";
  const std::string spice = std::string("\r\n\0\t %:?&=/#\x7f\xff\xc3", 16) + "0aAhH";
  int accepted = 0;
  for (std::uint64_t round = 0; round < 50'000; ++round) {
    Random random(1, round);
    std::string text = good;
    const int changes = 1 + static_cast<int>(random.next() % 4);
    for (int i = 0; i < changes; ++i) {
      const std::size_t at = random.next() % text.size();
      const char c = spice[random.next() % spice.size()];
      if (random.next() % 3 == 0)
        text.insert(at, 1, c);
      else if (random.next() % 2 == 0)
        text.erase(at, 1 + random.next() % 3);
      else
        text[at] = c;
      if (text.empty()) text = "x";
    }
    const auto head = parse_head(text);
    if (!head) continue;
    ++accepted;
    const auto clean = [](const std::string& value) {
      return std::none_of(value.begin(), value.end(),
                          [](char c) { return (c >= 0 && c < ' ' && c != '\t') || c == 0x7f; });
    };
    ASSERT_TRUE(head->path.starts_with('/') && clean(head->path)) << text;
    for (const auto& [name, value] : head->params) ASSERT_TRUE(clean(name) && clean(value)) << text;
    for (const Field& field : head->fields)
      ASSERT_TRUE(!field.name.empty() && clean(field.name) && clean(field.value)) << text;
    ASSERT_LE(count_fields(*head, "content-length"), 1U) << text;
    ASSERT_EQ(count_fields(*head, "transfer-encoding"), 0U) << text;
  }
  EXPECT_GT(accepted, 1000);  // the loop looked at something
}

TEST(PercentDecode, RefusesBrokenEscapesControlBytesAndFalseUtf8) {
  for (const char* bad : {"%", "%4", "%4g", "%00", "%0A", "%7f", "%ff", "%c0%af", "%ed%a0%80", "%f5%80%80%80", "a\x01"})
    EXPECT_FALSE(percent_decode(bad).has_value()) << bad;
  EXPECT_EQ(percent_decode("%41%e2%82%ac"), "A\xe2\x82\xac");
}

TEST(Multipart, IsTheSameHoweverItsBytesArrive) {
  const std::string form =
      "preamble\r\n--b1\r\ncontent-disposition: form-data; name=a\r\n\r\n1\r\n--b\r\n2\r\n"
      "--b1\r\nX: y\r\nContent-Disposition: form-data; name=\"f\"; "
      "filename=\"q\\\"r.bin\"\r\n\r\n\r\n--b1--\r\nepilogue";
  for (const std::size_t piece : {1UL, 2UL, 3UL, 7UL, 1000UL}) {
    SCOPED_TRACE(piece);
    Text body(form, piece);
    auto reader = MultipartReader::open(form_head("multipart/form-data; boundary=b1"), body);
    ASSERT_TRUE(reader.has_value());
    auto first = reader->next();
    ASSERT_TRUE(first.has_value() && first->has_value());
    EXPECT_EQ((*first)->name, "a");
    EXPECT_EQ(read_part_text(*reader, 100).value(), "1\r\n--b\r\n2");
    auto second = reader->next();
    ASSERT_TRUE(second.has_value() && second->has_value());
    EXPECT_EQ((*second)->filename, "q\"r.bin");
    EXPECT_EQ(read_part_text(*reader, 100).value(), "");
    auto end = reader->next();
    ASSERT_TRUE(end.has_value());
    EXPECT_FALSE(end->has_value());
  }
}

TEST(Multipart, CutAnywhereItIsRefusedAndNeverRead) {
  const std::string form = "--b\r\nContent-Disposition: form-data; name=\"a\"\r\n\r\nvalue\r\n--b--";
  for (std::size_t length = 0; length < form.size(); ++length) {
    Text body(form.substr(0, length), 5);
    auto reader = MultipartReader::open(form_head("multipart/form-data; boundary=b"), body);
    bool refused = false;
    for (int i = 0; i < 3 && !refused; ++i) {
      auto part = reader->next();
      refused = !part || (part->has_value() && !read_part_text(*reader, 100));
    }
    EXPECT_TRUE(refused) << length;
  }
}

TEST(Multipart, SkipsPartsThatNobodyReads) {
  Text body("--b\r\nContent-Disposition: form-data; name=a\r\n\r\n" + std::string(200'000, 'x') +
                "\r\n--b\r\nContent-Disposition: form-data; name=z\r\n\r\n1\r\n--b--",
            4096);
  auto reader = MultipartReader::open(form_head("multipart/form-data; boundary=b"), body);
  ASSERT_TRUE(reader->next().has_value());
  EXPECT_EQ(reader->next().value()->name, "z");
}

TEST(Multipart, NeedsABoundary) {
  Text body("", 1);
  for (const char* type : {"multipart/form-data", "multipart/form-data; boundary=", "multipart/form-data; boundary=\"",
                           "multipart/form-data; boundary=\"a b\""})
    EXPECT_FALSE(MultipartReader::open(form_head(type), body).has_value()) << type;
}

}  // namespace
}  // namespace kiln
