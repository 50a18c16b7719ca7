#include "tests/bench/trade/sweep.h"

#include <nlohmann/json.hpp>

namespace kiln::trade {
namespace {

using nlohmann::json;

/// A knob of the step, and the values it takes while everything else stays at the standard quality.
struct Knob {
  const char* name;
  const char* before;  // JSON around the value
  std::vector<std::string> values;
  const char* after;
};

const std::vector<Knob>& knobs() {
  static const std::vector<Knob> all = {
      {"bits", R"({"encoding":{"bits":)", {"8", "10", "14", "16"}, "}}"},
      {"samples", R"({"samples":)", {"64", "256", "4096"}, "}"},
      {"bounces", R"({"bounces":)", {"0", "1", "3"}, "}"},
      {"order", R"({"order":)", {"3", "4", "8", "10"}, "}"},
      {"measure", R"({"subdivide":{"measure":)", {R"("eq2")", R"("eq3")", R"("eq4")"}, "}}"},
      {"threshold", R"({"subdivide":{"threshold":)", {"0.0002", "0.00001"}, "}}"},
  };
  return all;
}

std::string words(std::string value) {
  std::erase(value, '"');
  return value;
}

void add_knobs(std::vector<Setting>& all) {
  for (const Knob& knob : knobs()) {
    for (const std::string& value : knob.values)
      all.push_back({std::string("standard, ") + knob.name + " " + words(value),
                     "standard",
                     knob.before + value + knob.after,
                     {}});
  }
  all.push_back({"standard, no split", "standard", R"({"subdivide":"off"})", {}});
}

void add_triangles(std::vector<Setting>& all, const std::string& quality, std::uint64_t more, const std::string& name,
                   const std::string& step = "{}") {
  all.push_back({quality + ", " + name, quality, step, more});
}

/// Samples by triangles: the two knobs that cost most, together.
void add_factorial(std::vector<Setting>& all, const std::string& quality, const std::vector<int>& samples,
                   const std::vector<std::uint64_t>& more) {
  for (const int s : samples) {
    for (const std::uint64_t m : more)
      add_triangles(all, quality, m, "samples " + std::to_string(s) + ", +" + std::to_string(m) + " triangles",
                    json{{"samples", s}}.dump());
  }
}

}  // namespace

Sweep full_sweep() {
  std::vector<Setting> all = {
      {"draft", "draft", "{}", {}}, {"standard", "standard", "{}", {}}, {"final", "final", "{}", {}}};
  // Around draft, where a run costs little.
  all.push_back({"draft, order 6", "draft", R"({"order":6})", {}});
  all.push_back({"draft, order 6, bits 12", "draft", R"({"order":6,"encoding":{"bits":12}})", {}});
  add_factorial(all, "draft", {64, 256, 512}, {2'500, 20'000});
  add_knobs(all);
  add_triangles(all, "standard", 10'000, "+10000 triangles");
  add_triangles(all, "standard", 20'000, "+20000 triangles");
  add_triangles(all, "standard", 160'000, "+160000 triangles");
  add_factorial(all, "standard", {256, 512, 2048}, {20'000, 80'000});
  add_factorial(all, "final", {1024, 2048}, {40'000, 160'000});
  return {all, {"draft", "standard", "final"}};
}

Sweep smoke_sweep() {
  std::vector<Setting> all;
  const auto add = [&](const char* name, int samples, int order, std::uint64_t more) {
    all.push_back({name, "draft", json{{"samples", samples}, {"order", order}, {"bounces", 1}}.dump(), more});
  };
  add("smoke draft", 16, 2, 50);
  add("smoke standard", 64, 3, 200);
  add("smoke standard, order 2", 64, 2, 200);
  add("smoke final", 256, 3, 800);
  return {all, {"smoke draft", "smoke standard", "smoke final"}};
}

std::string recipe_of(const Setting& setting, std::uint64_t scene_triangles) {
  json step = json::parse(setting.step);
  step["do"] = "prt";
  if (setting.more_triangles) step["subdivide"]["triangles"] = scene_triangles + *setting.more_triangles;
  return json{{"environment", {{"builtin", "clear"}}}, {"quality", setting.quality}, {"steps", {step}}}.dump();
}

}  // namespace kiln::trade
