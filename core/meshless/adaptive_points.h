#pragma once
// Which points of a hierarchy are computed: coarse to fine, the finer ones where coarser ones do not predict.
//   1. the first levels everywhere, and points that were asked for (demand.h)
//   2. of a finer level the points around those of the level above that are not what the points before predict there,
//      and those that see none which was computed
//   3. all of those in gaps (cover.h): there light changes over less than points are apart
// A prediction is read from all points computed so far (reading.h).
// Paper   Lehtinen et al. 2007, sections 6.3 and 6.4: RECEIVER-ORACLE.
// Differs the paper asks on the coarsest level for the variation among neighbours, on finer ones for the coefficient.
//         On a flattened set both are one question: how far a point is from what the points before it say.
// Repeat  same points for any thread count

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/base/threads.h"
#include "core/meshless/basis.h"
#include "core/meshless/points.h"
#include "core/trace/tracer.h"

namespace kiln {

struct AdaptivePoints {
  const Tracer& tracer;
  const PointHierarchy& points;
  int uniform_levels = 3;  // at least 1
  int neighbours = 10;     // of computed points around a place, which it is read from
  std::size_t first = 0;   // so many points are computed whatever their level
  /// Computes points; called with ever finer ones, along the Morton curve. The n-th point that was ever computed is the
  /// n-th in the result.
  std::function<void(std::span<const std::uint32_t> points)> compute;
  /// Whether the n-th of them is not what those before it predict. Called from many threads.
  std::function<bool(std::size_t n, std::span<const BasisTerm> prediction)> wrong;
};

/// The points that were computed, in order.
std::vector<std::uint32_t> compute_adaptively(const AdaptivePoints&, Threads&);

}  // namespace kiln
