// What does accuracy cost? Sweeps the knobs of the prt step over scenes: a CSV row a run, two plots, three presets.
//   kiln-trade --out FOLDER [--smoke] [--scenes column,a.glb] [--minutes N] [--fresh]
// FOLDER/trade.csv is appended to after each run, and runs that it holds are not repeated: an interrupted sweep is
// continued by the same command. --fresh begins it anew, --minutes starts no run after that time.
// Writes time.svg, bytes.svg and presets.json from the rows of this engine; prints the presets beside those in force
// and how far the plan's predictions were off. Asserts nothing. `row.h` says what the columns mean, `choose.h` the
// rule.

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/bake/bake.h"
#include "tests/bench/bench.h"
#include "tests/bench/trade/choose.h"
#include "tests/bench/trade/csv.h"
#include "tests/bench/trade/pictures.h"
#include "tests/bench/trade/ratios.h"
#include "tests/bench/trade/run.h"
#include "tests/bench/trade/scenes.h"
#include "tests/bench/trade/sweep.h"

namespace kiln::trade {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  std::string out;
  std::vector<std::string> scenes;
  bool smoke = false, fresh = false;
  double minutes = 1e9;
};

std::vector<std::string> split_list(const std::string& text) {
  std::vector<std::string> out(1);
  for (const char c : text) {
    if (c == ',') {
      out.emplace_back();
    } else {
      out.back() += c;
    }
  }
  return out;
}

std::optional<Arguments> parse_arguments(int count, char** words) {
  Arguments out;
  for (int i = 1; i < count; ++i) {
    const std::string word = words[i];
    const bool more = i + 1 < count;
    if (word == "--smoke") {
      out.smoke = true;
    } else if (word == "--fresh") {
      out.fresh = true;
    } else if (word == "--out" && more) {
      out.out = words[++i];
    } else if (word == "--scenes" && more) {
      out.scenes = split_list(words[++i]);
    } else if (word == "--minutes" && more) {
      out.minutes = std::atof(words[++i]);
    } else {
      std::fprintf(stderr, "kiln-trade: %s is no option\n", word.c_str());
      return std::nullopt;
    }
  }
  if (out.out.empty()) return std::nullopt;
  if (out.scenes.empty()) out.scenes = out.smoke ? std::vector<std::string>{"column"} : bundled_scenes();
  return out;
}

int complain(const Fault& f) {
  std::fprintf(stderr, "kiln-trade: %s%s%s (%s)\n", f.where.c_str(), f.where.empty() ? "" : ": ", f.message.c_str(),
               f.code.c_str());
  return 1;
}

struct CountedScene {
  TradeScene scene;
  std::uint64_t triangles = 0;
};

Result<std::vector<CountedScene>> load_scenes(const std::vector<std::string>& names) {
  std::vector<CountedScene> out;
  for (const std::string& name : names) {
    KILN_TRY(scene, load_trade_scene(name));
    KILN_TRY(triangles, count_triangles(scene));
    out.push_back({std::move(scene), triangles});
  }
  return out;
}

void tell(const Row& row) {
  std::printf("%-14s %-42s %8.2f s (processor %.2f) %6.2f %% [%.2f, %.2f] %9.0f kB %5.0f MB\n", row.scene.c_str(),
              row.setting.c_str(), row.seconds, row.cpu_seconds, 100 * row.seen.relrmse, 100 * row.seen.low,
              100 * row.seen.high, static_cast<double>(row.artifact_bytes) / 1e3,
              static_cast<double>(row.peak_memory_bytes) / 1e6);
  std::fflush(stdout);
}

/// A setting on all scenes before the next, so that a sweep cut short has whole settings.
Result<void> sweep_all(const Sweep& sweep, const std::vector<CountedScene>& scenes, const Arguments& arguments,
                       std::vector<Row>& rows) {
  const std::string path = arguments.out + "/trade.csv";
  const double start = bench::wall_seconds();
  std::set<std::string> done;
  for (const Row& row : rows) done.insert(key_of(row));
  std::size_t ran = 0, known = 0, left = 0;
  for (const Setting& setting : sweep.settings) {
    const bool late = bench::wall_seconds() - start > 60 * arguments.minutes;
    for (const CountedScene& s : scenes) {
      KILN_TRY(planned, planned_row(s.scene, setting.name, recipe_of(setting, s.triangles)));
      if (!done.insert(key_of(planned)).second) {
        ++known;
      } else if (late) {
        ++left;
      } else {
        KILN_TRY(row, run(s.scene, planned, {.thorough = !arguments.smoke}));
        if (auto written = append_row(path, row); !written) return written;
        tell(row);
        rows.push_back(std::move(row));
        ++ran;
      }
    }
  }
  std::printf("runs: %zu new, %zu known, %zu left\n", ran, known, left);
  return {};
}

bool write_text(const std::string& path, const std::string& text) {
  std::ofstream out(path, std::ios::binary);
  out << text << std::flush;
  return out.good();
}

/// Everything that follows from the rows alone.
Result<void> conclude(const Sweep& sweep, const Arguments& arguments, std::vector<Row> rows) {
  std::erase_if(rows, [](const Row& row) { return row.engine != kEngineVersion; });
  if (!write_text(arguments.out + "/time.svg", time_svg(rows, sweep.presets)) ||
      !write_text(arguments.out + "/bytes.svg", bytes_svg(rows, sweep.presets)))
    return fault("not_written", "could not be written", arguments.out);
  std::printf("\n%s\n", ratios_text(prediction_ratios(rows)).c_str());
  const std::vector<SettingMeans> means = means_over_scenes(rows);
  KILN_TRY(choices, choose_presets(means, sweep.presets));
  std::printf("%s", presets_text(choices).c_str());
  if (!write_text(arguments.out + "/presets.json", presets_json(choices, means, sweep, rows)))
    return fault("not_written", "could not be written", arguments.out);
  return {};
}

int main_of(const Arguments& arguments) {
  fs::create_directories(arguments.out);
  const std::string path = arguments.out + "/trade.csv";
  if (arguments.fresh) fs::remove(path);
  auto rows = open_rows(path);
  if (!rows) return complain(rows.error());
  const Sweep sweep = arguments.smoke ? smoke_sweep() : full_sweep();
  const auto scenes = load_scenes(arguments.scenes);
  if (!scenes) return complain(scenes.error());
  const auto swept = sweep_all(sweep, *scenes, arguments, *rows);
  if (!swept) return complain(swept.error());
  const auto concluded = conclude(sweep, arguments, *rows);
  return concluded ? 0 : complain(concluded.error());
}

}  // namespace
}  // namespace kiln::trade

int main(int count, char** words) {
  const auto arguments = kiln::trade::parse_arguments(count, words);
  if (!arguments) {
    std::fprintf(stderr, "kiln-trade --out FOLDER [--smoke] [--scenes column,a.glb] [--minutes N] [--fresh]\n");
    return 2;
  }
  return kiln::trade::main_of(*arguments);
}
