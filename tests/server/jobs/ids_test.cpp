#include "server/jobs/ids.h"

#include <gtest/gtest.h>

#include <set>

namespace kiln {
namespace {

TEST(Ulid, IdsGrowWhileTheClockStandsStillOrGoesBack) {
  UlidGenerator ids;
  std::string last;
  for (int i = 0; i < 1000; ++i) {
    const std::string id = ids.next(1'800'000'000'000 - i / 10);
    EXPECT_EQ(id.size(), 26U);
    EXPECT_GT(id, last);
    last = id;
  }
}

TEST(Ulid, TheFirstTenLettersAreTheTime) {
  // 1469918176385 ms is 01ARYZ6S41 in the ULID specification's own example.
  EXPECT_EQ(UlidGenerator().next(1'469'918'176'385).substr(0, 10), "01ARYZ6S41");
}

TEST(Token, TokensAreHexAndDoNotRepeat) {
  std::set<std::string> seen;
  for (int i = 0; i < 1000; ++i) {
    const std::string token = random_token();
    EXPECT_EQ(token.size(), 32U);
    EXPECT_EQ(token.find_first_not_of("0123456789abcdef"), std::string::npos);
    EXPECT_TRUE(seen.insert(token).second);
  }
}

}  // namespace
}  // namespace kiln
