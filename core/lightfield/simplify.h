#pragma once
// Simplification that sees light: edges collapse in the order of what they change of the radiance towards every eye.
//
// The collapse that costs least (collapse_cost.h) goes first. It is refused where it would change the topology, turn a
// triangle over, or let creases join; so a target may be out of reach, and the result says how far it came. The new
// vertex lies where the quadrics are least or at either end; its normal, light and other attributes are those of the
// nearest place on the edge. Vertices at one position move together (surface_points.h, collapse_mesh.h).
// Paper    Vanhoey et al. 2015, section 4.   Units  of Mesh and LightField
// Cost     n log n; README.md has times and memory
// Repeat   same bits for any number of threads: they only prepare the first costs
// Fails    never on a valid Mesh; Cancelled if stopped

#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "core/base/threads.h"
#include "core/lightfield/collapse_cost.h"
#include "core/lightfield/lit_mesh.h"

namespace kiln {

struct Simplify {
  std::size_t triangles = 0;                                   // as few as this, where topology and shape allow
  double max_error = std::numeric_limits<double>::infinity();  // of `error` below: ends before it would be exceeded
  double max_reach = std::numeric_limits<double>::infinity();  // how far the surface may move: collapse_reach.h
  double geometry_weight = 0.01;                               // 0 .. 1; the light has the rest
  double mean_square = 0;  // of the light that `error` is relative to; 0: the field's own
  Collapse collapse = Collapse::edge;
  bool record = false;  // of every collapse, for progressive_mesh()
  std::function<void(std::uint64_t done, std::uint64_t all)> progress = {};  // triangles, now and then
};

/// What a collapse took away. Indices are of CollapseRecord::all.
struct CollapseStep {
  std::uint32_t pairs = 1;  // vertices gone[i] went into kept[i]
  std::array<std::uint32_t, 2> gone{}, kept{};
  std::size_t orphans = 0, moved = 0, removed = 0, turned = 0;  // ends of this step in the arrays of CollapseRecord
  float error = 0;                                              // SimplifyResult::error once this step was done
};

struct CollapseRecord {
  std::vector<CollapseStep> steps;
  std::vector<std::uint32_t> orphans;  // vertices without a triangle left
  std::vector<std::uint32_t> moved;    // vertices that got other attributes,
  LitMesh before;                      // and what they were: a vertex for each element of `moved`
  std::vector<std::uint32_t> removed;  // triangles, which keep the corners they had
  std::vector<std::uint32_t> turned;   // 2 triangle + i: its corner went from gone[i] to kept[i]
  LitMesh all;                         // every vertex, and triangle, as it was last
};

struct SimplifyResult {
  LitMesh lit;
  double error = 0;      // an estimate, from the costs, of the relative RMS error of light and shape: README.md
  bool reached = false;  // the asked number of triangles
  CollapseRecord record;
};

SimplifyResult simplify(LitMesh, const Simplify&, Threads&);

}  // namespace kiln
