#pragma once
// Presets from the rows, by rule and not by taste.
//
// Setting    counts when it was run on every scene that has rows.
// Time       geometric mean over scenes of the processor seconds: a busy machine changes them least.
// Error      geometric mean over scenes and over both judgements of accuracy.md: transport where it can be seen, and
//            the job's light in full detail. So halving either counts the same, and an order is not cheap for holding
//            less light. Errors below kSmallestError count as that: no interval of 8192 points reaches lower.
// Front      fewest bytes first, a setting joins unless one that has joined is as good: at most kTimeNoise of its time
//            and kErrorNoise of its error. Of those that joined, what none beats in both time and error. So of settings
//            that differ by noise alone the smallest artefact stands for all.
// Choice     with t the time of the standard in force: draft, standard and final are the points of the front whose
//            time is nearest to t / 8, t and 8 t, as ratios; of two as near, the one of smaller error.

#include <array>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "tests/bench/trade/row.h"
#include "tests/bench/trade/sweep.h"

namespace kiln::trade {

inline constexpr double kSmallestError = 1e-3;
inline constexpr double kTimeNoise = 1.2;    // as much did the time differ of bakes whose bits alone differed
inline constexpr double kErrorNoise = 1.02;  // relative; the same points and paths judge all settings of a mesh
inline constexpr std::array<double, 3> kTimes = {1.0 / 8, 1, 8};  // draft, standard, final; in standards in force

struct SettingMeans {
  std::string setting;
  double seconds = 0, bytes = 0;              // geometric means over scenes
  double error = 0, seen = 0, job_light = 0;  // `error` is that of both
  bool in_front = false;
};

struct Choice {
  std::string preset;  // "draft", "standard", "final"
  double wanted_seconds = 0;
  SettingMeans in_force, chosen;
};

double geometric_mean(std::span<const double>);

/// Means of the settings run on all scenes, in the order of their first row. Of rows that repeat a scene and setting
/// the last counts.
std::vector<SettingMeans> means_over_scenes(std::span<const Row>);

/// Fails  no_standard when a preset in force was not run on all scenes
Result<std::vector<Choice>> choose_presets(std::span<const SettingMeans>, const PresetNames&);

/// presets.json: the rule, what is in force, what the rule chooses, each with its numbers and reason.
std::string presets_json(const std::vector<Choice>&, std::span<const SettingMeans>, const Sweep&, std::span<const Row>);

/// The same for a terminal.
std::string presets_text(const std::vector<Choice>&);

}  // namespace kiln::trade
