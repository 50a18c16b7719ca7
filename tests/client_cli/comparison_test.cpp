#include "client_cli/comparison.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/client_cli/run_kiln.h"

namespace kiln {
namespace {

ValueTable table_of(const std::vector<double>& values, double standard_error = 0) {
  ValueTable table;
  table.has_errors = standard_error > 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Vec3d value{values[i], values[i], values[i]}, error{standard_error, standard_error, standard_error};
    table.points.push_back({{static_cast<double>(i), 0, 0}, {0, 1, 0}});
    table.values.push_back({value, value, 0, error, error});
  }
  return table;
}

TEST(Comparison, IsTheRootMeanSquareOverTheMean) {
  // Errors 0.3 and -0.4 around a mean of 5: sqrt((0.09 + 0.16) / 2) / 5. Tolerances are double rounding.
  const auto comparison = compare_values(table_of({4.3, 5.6}), table_of({4, 6}), "irradiance", 0);
  ASSERT_TRUE(comparison);
  EXPECT_NEAR(comparison->stats.relrmse, std::sqrt(0.125) / 5, 1e-12);
  EXPECT_NEAR(comparison->stats.bias, -0.05 / 5, 1e-12);
  EXPECT_FALSE(comparison->noise_known);
}

TEST(Comparison, TakesTheVarianceOfTheReferenceAway) {
  // (0.5^2 - 0.3^2) = 0.4^2
  const auto comparison = compare_values(table_of({1.5, 0.5}), table_of({1, 1}, 0.3), "radiance", 0);
  ASSERT_TRUE(comparison);
  EXPECT_NEAR(comparison->stats.relrmse, 0.4, 1e-12);
  EXPECT_TRUE(comparison->noise_known);
}

TEST(Comparison, LeavesPointsWithoutAValueOutAndCountsThem) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto comparison = compare_values(table_of({1, nan, 1}), table_of({1, 1, 1}), "irradiance", 0);
  ASSERT_TRUE(comparison);
  EXPECT_EQ(comparison->skipped, 1U);
  EXPECT_EQ(comparison->stats.points, 2U);
  EXPECT_FALSE(compare_values(table_of({nan}), table_of({1}), "irradiance", 0));
}

TEST(Comparison, RefusesDifferentPoints) {
  EXPECT_FALSE(compare_values(table_of({1, 2}), table_of({1}), "irradiance", 0));
  ValueTable moved = table_of({1, 2});
  moved.points[1].position.y = 0.1;
  const auto comparison = compare_values(table_of({1, 2}), moved, "irradiance", 0);
  ASSERT_FALSE(comparison);
  EXPECT_EQ(comparison.error().problem.code, "different_points");
  EXPECT_EQ(comparison.error().exit, ExitCode::rejected);
}

TEST(Values, ATableComesBackFromItsCsvAsItWas) {
  const Folder folder;
  ValueTable table = table_of({0.1, 2.5}, 0.01);
  table.points[0] = {{1e7 + 1e-3, -0.1, 3}, {0.6, 0.8, 0}};
  const auto read = read_values(folder.write("v.csv", values_csv(table)));
  ASSERT_TRUE(read);
  ASSERT_EQ(read->points.size(), 2U);
  EXPECT_TRUE(read->has_errors);
  EXPECT_EQ(read->points[0].position, table.points[0].position) << "positions keep every bit";
  EXPECT_FLOAT_EQ(static_cast<float>(read->values[1].irradiance.x), 2.5F);
  EXPECT_FLOAT_EQ(static_cast<float>(read->values[1].radiance_error.z), 0.01F);
}

TEST(Values, PointsMayCarryAViewDirectionAndMustBeFinite) {
  const Folder folder;
  const auto points = read_points(folder.write("p.csv", "1,2,3,0,1,0,0,0,1\n"));
  ASSERT_TRUE(points);
  EXPECT_EQ((*points)[0].normal, (Vec3d{0, 1, 0}));
  const auto broken = read_points(folder.write("q.csv", "x,y,z,nx,ny,nz\n1,2,3,0,1,0\n1,nan,3,0,1,0\n"));
  ASSERT_FALSE(broken);
  EXPECT_NE(broken.error().problem.where.find("line 3"), std::string::npos);
  const auto short_row = read_points(folder.write("r.csv", "1,2,3\n"));
  ASSERT_FALSE(short_row);
  EXPECT_EQ(short_row.error().problem.code, "missing_column");
}

}  // namespace
}  // namespace kiln
