#include "tests/bench/trade/choose.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <set>

#include "tests/bench/trade/front.h"

namespace kiln::trade {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

std::set<std::string> scenes_of(std::span<const Row> rows) {
  std::set<std::string> out;
  for (const Row& row : rows) out.insert(row.scene);
  return out;
}

SettingMeans means_of(const std::string& setting, const std::map<std::string, const Row*>& by_scene) {
  std::vector<double> seconds, bytes, seen, job_light;
  for (const auto& [scene, row] : by_scene) {
    seconds.push_back(row->cpu_seconds);
    bytes.push_back(static_cast<double>(row->artifact_bytes));
    seen.push_back(std::max(row->seen.relrmse, kSmallestError));
    job_light.push_back(std::max(row->job_light.relrmse, kSmallestError));
  }
  SettingMeans out{setting, geometric_mean(seconds), geometric_mean(bytes),
                   0,       geometric_mean(seen),    geometric_mean(job_light)};
  out.error = std::sqrt(out.seen * out.job_light);
  return out;
}

/// Settings without those that a smaller artefact matches within the noise.
std::vector<std::size_t> worth_their_bytes(std::span<const SettingMeans> all) {
  std::vector<std::size_t> order(all.size()), joined;
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return all[a].bytes < all[b].bytes; });
  for (const std::size_t i : order) {
    const bool matched = std::any_of(joined.begin(), joined.end(), [&](std::size_t j) {
      return all[j].seconds <= kTimeNoise * all[i].seconds && all[j].error <= kErrorNoise * all[i].error;
    });
    if (!matched) joined.push_back(i);
  }
  return joined;
}

void mark_front(std::span<SettingMeans> all) {
  const std::vector<std::size_t> joined = worth_their_bytes(all);
  std::vector<CostError> points;
  for (const std::size_t i : joined) points.push_back({all[i].seconds, all[i].error});
  for (const std::size_t k : pareto_front(points)) all[joined[k]].in_front = true;
}

const SettingMeans* find(std::span<const SettingMeans> all, const std::string& setting) {
  const auto found = std::find_if(all.begin(), all.end(), [&](const auto& m) { return m.setting == setting; });
  return found == all.end() ? nullptr : &*found;
}

SettingMeans nearest_in_front(std::span<const SettingMeans> all, double seconds) {
  const SettingMeans* best = nullptr;
  const auto far = [&](const SettingMeans& m) { return std::abs(std::log(m.seconds / seconds)); };
  for (const SettingMeans& m : all) {
    if (!m.in_front) continue;
    if (!best || far(m) < far(*best) || (far(m) == far(*best) && m.error < best->error)) best = &m;
  }
  return *best;
}

std::string number(const char* format, double x) {
  char out[64];
  std::snprintf(out, sizeof out, format, x);
  return out;
}

std::string reason_of(const Choice& c, double standard_seconds) {
  return "of the front the nearest to " + number("%.3g", c.wanted_seconds) + " s, " +
         number("%.3g", c.wanted_seconds / standard_seconds) +
         " times the standard in force: " + number("%.3g", c.chosen.seconds / c.in_force.seconds) +
         " of the time and " + number("%.3g", c.chosen.error / c.in_force.error) + " of the error of the " + c.preset +
         " in force";
}

ordered_json means_json(const SettingMeans& m) {
  return {{"setting", m.setting},   {"cpu_seconds", m.seconds},         {"artifact_bytes", m.bytes}, {"error", m.error},
          {"relrmse_seen", m.seen}, {"relrmse_job_light", m.job_light}, {"in_front", m.in_front}};
}

/// What the setting asks for, and what was in force in each scene.
ordered_json with_knobs(ordered_json out, const std::string& name, const Sweep& sweep, std::span<const Row> rows) {
  for (const Setting& s : sweep.settings) {
    if (s.name != name) continue;
    out["quality"] = s.quality;
    out["step"] = json::parse(s.step);
    if (s.more_triangles) out["triangles_added"] = *s.more_triangles;
  }
  out["parameters"] = json::object();
  for (const Row& row : rows) {
    if (row.setting == name) out["parameters"][row.scene] = json::parse(row.parameters);
  }
  return out;
}

}  // namespace

double geometric_mean(std::span<const double> values) {
  double sum = 0;
  for (const double v : values) sum += std::log(v);
  return values.empty() ? 0 : std::exp(sum / static_cast<double>(values.size()));
}

std::vector<SettingMeans> means_over_scenes(std::span<const Row> rows) {
  const std::size_t scenes = scenes_of(rows).size();
  std::vector<std::string> order;
  std::map<std::string, std::map<std::string, const Row*>> by_setting;
  for (const Row& row : rows) {
    if (!by_setting.contains(row.setting)) order.push_back(row.setting);
    by_setting[row.setting][row.scene] = &row;
  }
  std::vector<SettingMeans> out;
  for (const std::string& setting : order) {
    if (by_setting[setting].size() == scenes) out.push_back(means_of(setting, by_setting[setting]));
  }
  mark_front(out);
  return out;
}

Result<std::vector<Choice>> choose_presets(std::span<const SettingMeans> means, const PresetNames& names) {
  const std::array<std::pair<std::string, std::string>, 3> presets = {
      {{"draft", names.draft}, {"standard", names.standard}, {"final", names.final}}};
  const SettingMeans* standard = find(means, names.standard);
  if (!standard) return fault("no_standard", names.standard + " was not run on every scene");
  std::vector<Choice> out;
  for (std::size_t i = 0; i < presets.size(); ++i) {
    const auto& [preset, setting] = presets[i];
    const SettingMeans* in_force = find(means, setting);
    if (!in_force) return fault("no_standard", setting + " was not run on every scene");
    const double wanted = kTimes[i] * standard->seconds;
    out.push_back({preset, wanted, *in_force, nearest_in_front(means, wanted)});
  }
  return out;
}

std::string presets_json(const std::vector<Choice>& choices, std::span<const SettingMeans> means, const Sweep& sweep,
                         std::span<const Row> rows) {
  ordered_json out = {
      {"engine", rows.empty() ? "" : rows.front().engine},
      {"scenes", scenes_of(rows)},
      {"rule",
       "Of the settings run on all scenes: geometric means over scenes of processor seconds, of bytes, and (over both "
       "judgements too: transport where it can be seen, the job's light in full detail) of relRMSE. Settings that a "
       "smaller artefact matches within 20 % of time and 2 % of error are left out; of the others' Pareto front in "
       "time "
       "and error draft, standard and final are the points whose time is nearest, as a ratio, to 1/8, 1 and 8 times "
       "that of the standard in force."},
      {"presets", ordered_json::object()},
      {"front", ordered_json::array()}};
  for (const Choice& c : choices) {
    out["presets"][c.preset] = {{"wanted_seconds", c.wanted_seconds},
                                {"reason", reason_of(c, choices[1].in_force.seconds)},
                                {"chosen", with_knobs(means_json(c.chosen), c.chosen.setting, sweep, rows)},
                                {"in_force", with_knobs(means_json(c.in_force), c.in_force.setting, sweep, rows)}};
  }
  std::vector<SettingMeans> front;
  std::copy_if(means.begin(), means.end(), std::back_inserter(front), [](const auto& m) { return m.in_front; });
  std::sort(front.begin(), front.end(), [](const auto& a, const auto& b) { return a.seconds < b.seconds; });
  for (const SettingMeans& m : front) out["front"].push_back(means_json(m));
  return out.dump(2) + "\n";
}

std::string presets_text(const std::vector<Choice>& choices) {
  std::string out = "presets (geometric means over scenes; error of both judgements)\n";
  char line[256];
  for (const Choice& c : choices) {
    const auto add = [&](const char* what, const SettingMeans& m) {
      std::snprintf(line, sizeof line, "  %-9s %-9s %-42s %8.2f s %8.2f %% %9.0f kB%s\n", c.preset.c_str(), what,
                    m.setting.c_str(), m.seconds, 100 * m.error, m.bytes / 1000,
                    m.in_front ? "" : "  not in the front");
      out += line;
    };
    add("in force", c.in_force);
    add("by rule", c.chosen);
  }
  return out;
}

}  // namespace kiln::trade
