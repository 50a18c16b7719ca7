#pragma once
// One run of the sweep: a row of trade.csv.

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/result.h"

namespace kiln::trade {

/// relRMSE and its 95 % interval (core/bake/error_stats.h).
struct Error {
  double relrmse = 0, low = 0, high = 0;
};

struct Row {
  std::string engine;        // kEngineVersion
  std::string scene;         // its name
  std::string scene_sha256;  // of its main file
  std::string setting;       // sweep.h
  std::string recipe;        // canonical JSON, without label and limits
  std::string parameters;    // JSON: what was in force (report.json)
  int threads = 0;
  double seconds = 0;      // of the whole bake by the wall clock, its own certificate and preview among it
  double cpu_seconds = 0;  // the same of all threads: what other work on the machine changes least
  std::uint64_t rays = 0, peak_memory_bytes = 0;
  std::uint64_t artifact_bytes = 0, triangles = 0, vertices = 0;  // of scene.glb

  // Measured anew by the tool, with another seed at other points than the bake's certificate.
  Error all;        // transport at all points
  Error seen;       // transport where it can be seen; `all` when nothing is hidden
  Error job_light;  // under the job's own light in full detail: what the order cannot hold is among it
  Error certified;  // transport as the bake's certificate has it

  double predicted_seconds = 0;  // by the plan, before a ray was traced
  std::uint64_t predicted_rays = 0, predicted_memory_bytes = 0, predicted_bytes = 0, predicted_vertices = 0;
};

/// What makes a run the same run: scene, recipe and engine.
std::string key_of(const Row&);

/// Bands of the artefact, from `parameters`; 0 when they do not say.
int order_of(const Row&);

const std::vector<std::string>& column_names();
std::vector<std::string> fields_of(const Row&);
/// Fails  bad_row when a number does not read as one or a field is missing
Result<Row> row_of(const std::vector<std::string>& fields);

}  // namespace kiln::trade
