#include "core/base/base64.h"

#include <gtest/gtest.h>

#include "core/base/digest.h"

namespace kiln {
namespace {

std::vector<std::uint8_t> bytes_of(const std::string& text) { return {text.begin(), text.end()}; }

TEST(Base64, KnownAnswersOfRfc4648) {
  const std::pair<const char*, const char*> known[] = {{"", ""},
                                                       {"f", "Zg=="},
                                                       {"fo", "Zm8="},
                                                       {"foo", "Zm9v"},
                                                       {"foob", "Zm9vYg=="},
                                                       {"fooba", "Zm9vYmE="},
                                                       {"foobar", "Zm9vYmFy"}};
  for (const auto& [plain, encoded] : known) {
    EXPECT_EQ(base64_encode(bytes_of(plain)), encoded);
    EXPECT_EQ(base64_decode(encoded), bytes_of(plain));
  }
}

TEST(Base64, BothAlphabetsAreReadAndOtherLettersAreNot) {
  EXPECT_EQ(base64_decode("-_+/"), base64_decode("+/+/"));
  EXPECT_EQ(base64_encode(*base64_decode("-_+/")), "+/+/");
  for (const char* wrong : {"A", "AAAAA", "AA A", "A=AA", "\xff\xff\xff\xff"})
    EXPECT_FALSE(base64_decode(wrong)) << wrong;
}

TEST(Digest, KnownAnswersOfFips180) {
  Digest sha1(DigestKind::sha1);
  sha1.update(bytes_of("abc"));
  EXPECT_EQ(base64_encode(sha1.bytes()), "qZk+NkcGgWq6PiVxeFDCbJzQ2J0=");
}

}  // namespace
}  // namespace kiln
