#pragma once
// What was asked for on the command line, as plain data: one struct for each command.

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace kiln {

/// Every command has these.
struct CommonOptions {
  bool json = false;
  std::string server;  // URL; --server or KILN_SERVER; empty: none
  std::string token;   // KILN_TOKEN, sent as a bearer token; empty: none
};

/// A light named on the command line: r,g,b | builtin:NAME | sha256 of an asset | a .hdr or .exr file.
struct LightOptions {
  std::string name;  // empty: not given
  std::optional<double> rotation_deg, intensity;
};

/// A recipe from a file or a preset, and what the command line changes in it.
struct RecipeOptions {
  std::string file, preset;
  LightOptions light;
  std::string label, quality;
  std::optional<double> target_error, time_budget_s;  // instead of a quality
  std::optional<std::uint64_t> seed;
  std::optional<int> threads;
  bool force = false;
};

struct BakeOptions {
  std::string input, output;  // output: folder; empty: made from the input's name
  RecipeOptions recipe;
  std::optional<double> max_error;
  std::string idempotency_key;
};
struct SubmitOptions {
  std::string input;
  RecipeOptions recipe;
  std::string idempotency_key;
};
struct PlanOptions {
  std::string input;
  RecipeOptions recipe;
};
struct WatchOptions {
  std::string id;
};
struct GetOptions {
  std::string id, output, artifact;  // output: folder, "" none: only the job is shown; artifact: "" all
};
struct ListOptions {
  std::string status, label, cursor;
  int limit = 50;
  bool all = false;
};
struct CancelOptions {
  std::vector<std::string> ids;
};
/// A job by its id, or a file by its SHA-256.
struct PinOptions {
  std::vector<std::string> ids;
  bool off = false;
};

struct RemoveOptions {
  std::vector<std::string> ids;
};
struct InspectOptions {
  std::string file;
};
struct EvalOptions {
  std::string file, points, output;
  LightOptions light;
  std::string lamp;       // of --light; empty: none
  bool indirect = false;  // with a lamp: reflected light only
  bool lightmap = false;
  bool scene_albedo = false;
  int sh_order = 0;
};
struct TruthOptions {
  std::string input, points, output;
  LightOptions light;
  std::string lamp;  // of --light; empty: none
  bool scene_albedo = false;
  bool indirect = false;    // reflected light only, as a grid holds it
  bool highlights = false;  // of punctual lights, towards eyes
  int samples = 1024, bounces = -1, sh_order = 0, threads = 0;
  std::uint64_t seed = 0;
};
struct CompareOptions {
  std::string a, b;
  std::optional<double> max_error;
  std::string column = "irradiance";
  LightOptions light;
  bool scene_albedo = false;
  std::uint64_t count = 4000, seed = 0;
};
struct PointsOptions {
  std::string input, output;
  std::uint64_t count = 1000, seed = 0;
  bool views = false, specular = false;
};
struct PresetsOptions {};
struct DemoSceneOptions {
  std::string name, output;
};
struct OpenOptions {
  std::string id;
};
struct CompletionOptions {
  std::string shell;
};

using CommandOptions =
    std::variant<BakeOptions, SubmitOptions, WatchOptions, GetOptions, ListOptions, CancelOptions, PinOptions,
                 RemoveOptions, PlanOptions, InspectOptions, EvalOptions, TruthOptions, CompareOptions, PointsOptions,
                 PresetsOptions, DemoSceneOptions, OpenOptions, CompletionOptions>;

struct Options {
  CommonOptions common;
  CommandOptions command;
};

}  // namespace kiln
