#include "client_cli/csv.h"

#include <gtest/gtest.h>

#include <cmath>

namespace kiln {
namespace {

const std::vector<std::string> kNames{"x", "y", "z"};

TEST(Csv, ReadsNumbersUnderNamesInAnyOrder) {
  const auto table = parse_csv("z,x\n1, 2.5\n\n# a remark\n-3e2,+4\r\n", "t.csv", kNames);
  ASSERT_TRUE(table);
  EXPECT_EQ(table->rows.size(), 2U);
  EXPECT_EQ(table->rows[1][*table->find("z")], -300);
  EXPECT_EQ(table->rows[1][*table->find("x")], 4);
  EXPECT_EQ(table->lines[1], 5U);
  EXPECT_FALSE(table->find("y"));
}

TEST(Csv, WithoutNamesTheColumnsHaveTheirPlaces) {
  const auto table = parse_csv("1,2,3\n4,5,nan", "t.csv", kNames);
  ASSERT_TRUE(table);
  EXPECT_EQ(table->columns, kNames);
  EXPECT_TRUE(std::isnan(table->rows[1][2]));
}

TEST(Csv, AMistakeIsNamedWithItsLine) {
  const auto ragged = parse_csv("1,2,3\n1,2\n", "t.csv", kNames);
  ASSERT_FALSE(ragged);
  EXPECT_EQ(ragged.error().problem.where, "t.csv: line 2");
  const auto word = parse_csv("x,y\n1,two\n", "t.csv", kNames);
  ASSERT_FALSE(word);
  EXPECT_EQ(word.error().problem.where, "t.csv: line 2");
  EXPECT_NE(word.error().problem.detail.find("two"), std::string::npos);
  EXPECT_EQ(word.error().exit, ExitCode::rejected);
  EXPECT_FALSE(parse_csv("1,2,3,4\n", "t.csv", kNames)) << "more columns than have names";
}

TEST(Csv, AnEmptyFileHasNoRows) {
  const auto table = parse_csv("", "t.csv", kNames);
  ASSERT_TRUE(table);
  EXPECT_TRUE(table->rows.empty());
}

TEST(Csv, NumbersReadBackAsTheyWere) {
  for (const double value : {0.1, -1e-300, 123456789.125, 1.0 / 3}) {
    const auto table = parse_csv(number_text(value), "", {"x"});
    ASSERT_TRUE(table);
    EXPECT_EQ(table->rows[0][0], value);
  }
}

}  // namespace
}  // namespace kiln
