// The parts of kiln-trade that hold without a bake.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>

#include "core/bake/recipe.h"
#include "core/base/random.h"
#include "tests/bench/trade/child.h"
#include "tests/bench/trade/choose.h"
#include "tests/bench/trade/csv.h"
#include "tests/bench/trade/front.h"
#include "tests/bench/trade/plot.h"
#include "tests/bench/trade/ratios.h"
#include "tests/bench/trade/svg.h"
#include "tests/bench/trade/sweep.h"

namespace kiln::trade {
namespace {

using Indices = std::vector<std::size_t>;

TEST(Front, KeepsWhatNothingBeatsByAscendingCost) {
  const std::vector<CostError> points = {{3, 1}, {1, 3}, {2, 2}, {2, 4}, {4, 1}, {5, 0.5}};
  EXPECT_EQ(pareto_front(points), (Indices{1, 2, 0, 5}));
}

TEST(Front, OfEqualPointsKeepsOneAndOfNoneNothing) {
  EXPECT_EQ(pareto_front(std::vector<CostError>{{1, 1}, {1, 1}}), (Indices{0}));
  EXPECT_TRUE(pareto_front({}).empty());
}

TEST(Front, IsItsDefinitionOnRandomPoints) {
  for (std::uint64_t round = 0; round < 50; ++round) {
    Random random(7, round);
    std::vector<CostError> p(40);
    for (CostError& one : p) one = {std::floor(10 * random.uniform_double()), std::floor(10 * random.uniform_double())};
    const Indices front = pareto_front(p);
    std::set<std::pair<double, double>> found, expected;
    for (const std::size_t i : front) found.insert({p[i].cost, p[i].error});
    for (const CostError& a : p) {
      bool beaten = false;
      for (const CostError& b : p)
        beaten |= b.cost <= a.cost && b.error <= a.error && (b.cost < a.cost || b.error < a.error);
      if (!beaten) expected.insert({a.cost, a.error});
    }
    EXPECT_EQ(found, expected);
    EXPECT_EQ(found.size(), front.size());
  }
}

TEST(TradeCsv, FieldsOfEveryKindComeBack) {
  const std::vector<std::string> fields = {"plain", "", "a,b", R"({"a":"b"})", "two\nlines", "\"", " spaces "};
  EXPECT_EQ(parse_csv(csv_line(fields) + "\n"), (std::vector<std::vector<std::string>>{fields}));
}

TEST(TradeCsv, ALastLineWithoutItsEndIsNotALine) {
  EXPECT_EQ(parse_csv("a,b\nc,d"), (std::vector<std::vector<std::string>>{{"a", "b"}}));
  EXPECT_EQ(parse_csv("a\r\n"), (std::vector<std::vector<std::string>>{{"a"}}));
}

Row some_row(const std::string& scene, const std::string& setting, double seconds, double error) {
  Row row;
  row.engine = "1";
  row.scene = scene;
  row.setting = setting;
  row.recipe = R"({"steps":[{"do":"prt"}],"of":")" + setting + "\"}";
  row.parameters = R"({"order":6})";
  row.threads = 2;
  row.seconds = row.cpu_seconds = row.predicted_seconds = seconds;
  row.artifact_bytes = 1000;
  row.all = row.seen = row.job_light = {error, error / 2, error * 2};
  return row;
}

class TradeFile : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "kiln_trade.XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
    path_ = (folder_ / "trade.csv").string();
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path folder_;
  std::string path_;
};

TEST_F(TradeFile, RowsComeBackAsTheyWereAppended) {
  EXPECT_TRUE(open_rows(path_)->empty());
  const Row first = some_row("room, \"closed\"", "standard", 1.25, 0.03125), second = some_row("b", "draft", 2, 0.5);
  ASSERT_TRUE(append_row(path_, first) && append_row(path_, second));
  const auto rows = open_rows(path_);
  ASSERT_TRUE(rows);
  ASSERT_EQ(rows->size(), 2U);
  EXPECT_EQ(fields_of((*rows)[0]), fields_of(first));
  EXPECT_EQ(key_of((*rows)[1]), key_of(second));
  EXPECT_EQ(order_of((*rows)[0]), 6);
}

TEST_F(TradeFile, ARowCutOffIsForgottenAndTheNextStandsOnALineOfItsOwn) {
  ASSERT_TRUE(append_row(path_, some_row("a", "draft", 1, 0.1)) && append_row(path_, some_row("b", "draft", 1, 0.1)));
  std::filesystem::resize_file(path_, std::filesystem::file_size(path_) - 5);
  EXPECT_EQ(open_rows(path_)->size(), 1U);
  ASSERT_TRUE(append_row(path_, some_row("c", "draft", 1, 0.1)));
  const auto rows = open_rows(path_);
  ASSERT_TRUE(rows);
  EXPECT_EQ(rows->back().scene, "c");
  EXPECT_EQ(rows->size(), 2U);
}

TEST_F(TradeFile, OtherColumnsAndBrokenNumbersAreRefusedWithTheirPlace) {
  std::ofstream(path_) << "x,y\n1,2\n";
  EXPECT_EQ(open_rows(path_).error().code, "other_columns");
  std::vector<std::string> fields = fields_of(some_row("a", "draft", 1, 0.1));
  fields[5] = "fast";
  std::ofstream(path_) << csv_line(column_names()) << "\n" << csv_line(fields) << "\n";
  const auto rows = open_rows(path_);
  ASSERT_FALSE(rows);
  EXPECT_EQ(rows.error().code, "bad_row");
  EXPECT_NE(rows.error().where.find("line 2 seconds"), std::string::npos) << rows.error().where;
}

TEST(Svg, TextCannotBecomeMarkup) {
  EXPECT_EQ(escape_xml("<a b=\"c\">&\x01"), "&lt;a b=&quot;c&quot;&gt;&amp;");
  EXPECT_EQ(element("a", {{"b", "\"<"}}), "<a b=\"&quot;&lt;\"/>");
  EXPECT_EQ(coordinate(-0.001), "0");
  EXPECT_EQ(coordinate(12.345678), "12.35");
}

TEST(Svg, APlotOfHostileNamesOfOnePointAndOfNoneIsStillAPlot) {
  Plot plot;
  plot.title = "</title><script>";
  plot.x_text = plot.y_text = [](double x) { return std::to_string(x); };
  EXPECT_EQ(scatter_svg(plot).find("nan"), std::string::npos);
  plot.series = {{"<b>", {{1, 0, 0, 0, true, "<i>", "draft"}}}};
  plot.smallest_y = 1e-3;
  const std::string svg = scatter_svg(plot);
  for (const char* bad : {"<script", "<b>", "<i>", "nan", "inf"}) EXPECT_EQ(svg.find(bad), std::string::npos) << bad;
  EXPECT_NE(svg.find("draft"), std::string::npos);
}

TEST(Svg, TicksAreRoundNumbersWithinTheRange) {
  EXPECT_EQ(log_ticks(0.9, 12), (std::vector<double>{1, 2, 5, 10}));
  EXPECT_EQ(log_ticks(2.5, 6), (std::vector<double>{3, 4, 5, 6}));
  EXPECT_EQ(log_ticks(0.01, 10), (std::vector<double>{0.01, 0.1, 1, 10}));
}

std::vector<Row> rows_of_a_sweep() {
  std::vector<Row> rows;
  const auto both = [&](const std::string& setting, double seconds, double error) {
    rows.push_back(some_row("a", setting, seconds / 2, error / 2));
    rows.push_back(some_row("b", setting, seconds * 2, error * 2));
  };
  both("draft", 2, 0.2);
  both("standard", 8, 0.05);
  both("better", 7, 0.04);
  both("quick", 1.1, 0.3);
  both("final", 50, 0.01);
  rows.push_back(some_row("a", "of one scene", 0.01, 0.001));
  return rows;
}

TEST(Choose, MeansAreGeometricOverScenesAndOnlyOfSettingsRunOnAll) {
  const auto means = means_over_scenes(rows_of_a_sweep());
  ASSERT_EQ(means.size(), 5U);
  EXPECT_NEAR(means[1].seconds, 8, 1e-12);
  EXPECT_NEAR(means[1].error, 0.05, 1e-12);
  EXPECT_FALSE(means[1].in_front);
  EXPECT_TRUE(means[2].in_front);
}

TEST(Choose, PresetsAreThePointsOfTheFrontNearestInTime) {
  const auto means = means_over_scenes(rows_of_a_sweep());
  const auto choices = choose_presets(means, {"draft", "standard", "final"});
  ASSERT_TRUE(choices);
  EXPECT_EQ((*choices)[0].chosen.setting, "quick");  // wanted 1 s
  EXPECT_EQ((*choices)[1].chosen.setting, "better");
  EXPECT_EQ((*choices)[2].chosen.setting, "final");  // wanted 64 s
  const auto json = nlohmann::json::parse(presets_json(*choices, means, full_sweep(), rows_of_a_sweep()));
  EXPECT_EQ(json["presets"]["final"]["chosen"]["setting"], "final");
  EXPECT_EQ(json["presets"]["draft"]["in_force"]["setting"], "draft");
}

TEST(Choose, OfSettingsThatDifferByNoiseTheSmallestArtefactStands) {
  std::vector<Row> rows = {some_row("a", "large", 8, 0.0499), some_row("a", "small", 8.5, 0.05),
                           some_row("a", "poor", 8, 0.06)};
  rows[0].artifact_bytes = 3000;
  rows[1].artifact_bytes = 2000;
  rows[2].artifact_bytes = 1000;
  const auto means = means_over_scenes(rows);
  EXPECT_FALSE(means[0].in_front);
  EXPECT_TRUE(means[1].in_front);
  EXPECT_TRUE(means[2].in_front);  // a little quicker
}

TEST(Choose, WithoutTheStandardInForceNothingIsChosen) {
  EXPECT_EQ(choose_presets(means_over_scenes(rows_of_a_sweep()), {"draft", "none", "final"}).error().code,
            "no_standard");
}

TEST(Choose, AnErrorOfZeroCountsAsTheSmallestThatCanBeMeasured) {
  const auto means = means_over_scenes(std::vector<Row>{some_row("a", "x", 1, 0)});
  EXPECT_NEAR(means[0].error, kSmallestError, 1e-12);
}

TEST(Ratios, AreThoseOfEachSceneAndTheWorstIsTheFarthestFromOne) {
  std::vector<Row> rows = {some_row("a", "x", 1, 1), some_row("a", "y", 2, 1), some_row("a", "z", 4, 1)};
  rows[1].predicted_seconds = 0.5;  // a quarter
  rows[2].predicted_seconds = 8;    // twice
  const auto ratios = prediction_ratios(rows);
  ASSERT_EQ(ratios.size(), 1U);
  EXPECT_NEAR(ratios[0].seconds.median, 1, 1e-12);
  EXPECT_NEAR(ratios[0].seconds.worst, 0.25, 1e-12);
  EXPECT_EQ(ratios[0].seconds.worst_setting, "y");
}

TEST(Child, GivesBackTextFaultsAndItsOwnDeath) {
  EXPECT_EQ(*in_child([]() -> Result<std::string> { return std::string(100'000, 'x'); }), std::string(100'000, 'x'));
  EXPECT_EQ(in_child([]() -> Result<std::string> { return fault("bad", "so it is"); }).error().message, "so it is");
  EXPECT_EQ(in_child([]() -> Result<std::string> { ::_exit(9); }).error().code, "child_died");
}

TEST(Sweep, EverySettingHasItsNameAndIsARecipeOfItsOwn) {
  for (const Sweep& sweep : {full_sweep(), smoke_sweep()}) {
    std::set<std::string> names, recipes;
    for (const Setting& setting : sweep.settings) {
      const auto recipe = parse_recipe(recipe_of(setting, 1000));
      ASSERT_TRUE(recipe) << setting.name << " " << recipe.error().front().pointer;
      EXPECT_TRUE(names.insert(setting.name).second) << setting.name;
      EXPECT_TRUE(recipes.insert(recipe_identity(*recipe)).second) << setting.name;
      EXPECT_EQ(recipe_identity(*parse_recipe(recipe_identity(*recipe))), recipe_identity(*recipe)) << setting.name;
    }
    for (const std::string& preset : {sweep.presets.draft, sweep.presets.standard, sweep.presets.final})
      EXPECT_TRUE(names.contains(preset)) << preset;
  }
}

}  // namespace
}  // namespace kiln::trade
