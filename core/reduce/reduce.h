#pragma once
// A model of any size down to a number of triangles, with textures for what they do not hold. All steps in order:
// measure, cluster or collect, collapse, atlas, project, maps.
//
// Paper    [Pacanowski06] section 2; what each step takes from whom is in its header
// Memory   `memory_bytes` bounds what this process holds; the source's own is counted in
// Repeat   same bits for any thread count
// Fails    as the source does; memory_limit where the limit is too small for any result

#include <functional>
#include <string>
#include <vector>

#include "core/reduce/reduce_method.h"
#include "core/reduce/surface_maps.h"

namespace kiln {

struct Reduce {
  std::uint64_t triangles = 100'000;  // of the result, at most
  ReduceMethod method = ReduceMethod::adaptive;
  int map_side = -1;    // texels along a side; 0: no map, -1: as the model and the memory ask
  int normal_bits = 8;  // of the map: 8 or 16
  std::uint64_t memory_bytes = 4096ULL << 20;
  std::uint64_t seed = 0;
  std::function<void(const std::string& stage, double fraction)> begin;  // a stage that ends at `fraction`
  std::function<void(std::uint64_t done, std::uint64_t total)> advance;  // triangles of a pass
};

/// What a reduction will do, from the header alone.
struct ReducePlan {
  bool unchanged = false;                 // no more triangles than asked for
  bool in_core = false;                   // collected whole, else clustered
  std::uint64_t cells = 0, vertices = 0;  // of the clustering: capacity, and what is left for the collapse
  int map_side = 0;
  int most_map_side = 0;  // what memory allows, where charts do not fit into `map_side`
  std::uint64_t memory_bytes = 0;
  double seconds = 0;
};
Result<ReducePlan> plan_reduction(const TriangleSource&, const Reduce&);

struct Reduced {
  Mesh mesh;  // unit cube
  UnitFrame frame;
  SurfaceMaps maps;           // side 0: none
  bool map_left_out = false;  // it was asked for, and its charts do not fit
  GeometricError error;
  double normal_degrees = 0, plain_normal_degrees = 0;  // RMS, through the map and without it
  std::uint64_t input_triangles = 0, clustered_triangles = 0;
  std::size_t charts = 0;
  std::uint64_t own_memory_bytes = 0;  // the most that was seen at the end of a stage or batch
};

Result<Reduced> reduce(const TriangleSource&, const ReducePlan&, const Reduce&, Threads&);

/// Memory of this process that is no page of a file, now.
std::uint64_t own_memory_bytes();

}  // namespace kiln
