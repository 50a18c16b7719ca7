#pragma once
// How points and vertices read light from the points that were computed, as sparse rows over those.
// Points   a computed one reads itself; others what they see of computed ones (reading.h), or nothing.
// Vertices what they see of computed ones; else what the nearest point that they see reads (senders.h). Vertices that
//          see no point at all are `alone`: they must find their light themselves.
// Repeat   same bits for any thread count

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/base/threads.h"
#include "core/meshless/points.h"
#include "core/meshless/reading.h"
#include "core/meshless/senders.h"

namespace kiln {

class SurfaceReading {
 public:
  struct Surface {
    const Tracer& tracer;
    const PointHierarchy& points;
    const Senders& senders;
    std::span<const TransferPoint> vertices;
  };
  /// `computed` holds points, in the order of what is read.
  SurfaceReading(const Surface&, std::span<const std::uint32_t> computed, int neighbours, Threads&);

  /// So that every point reads something: those that see nothing are computed too, and all is read anew, once.
  /// `compute` is given them along the Morton curve, and appends them to `computed`.
  using Compute = std::function<void(std::span<const std::uint32_t> points)>;
  static SurfaceReading of_all(const Surface&, const std::vector<std::uint32_t>& computed, int neighbours,
                               const Compute& compute, Threads&);

  /// Indices into `computed`, and weights that add up to 1; empty where nothing is seen.
  std::span<const BasisTerm> of_point(std::size_t point) const;
  std::span<const BasisTerm> of_vertex(std::size_t vertex) const;
  /// The same of any other place, appended; nothing where it must find its light itself.
  void of_place(const TransferPoint&, std::vector<BasisTerm>& terms) const;

  const std::vector<std::uint32_t>& alone() const { return alone_; }  // vertices, ascending

 private:
  void let_read_themselves(std::span<const std::uint32_t> computed);
  std::vector<std::uint32_t> unseen() const;  // points that read nothing

  Surface surface_;
  Reading reading_;
  Readings at_points_, at_vertices_;
  std::vector<BasisTerm> self_;         // of each point: itself among the computed ones, or no weight
  std::vector<std::uint32_t> nearest_;  // of vertices that see no computed point, or Senders::kNone
  std::vector<std::uint32_t> alone_;
};

}  // namespace kiln
