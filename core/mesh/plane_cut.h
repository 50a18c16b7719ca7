#pragma once
// One triangle cut along segments in its plane, into triangles that lie on one side of each.
//
// Pieces stay convex: a segment cuts every piece that it runs through along its whole line, so that it ends inside no
// triangle. Points on the border of the triangle are its neighbours' as well: the caller asks for theirs and adds them.
// Precision  places nearer than `near` to each other are one; so are a place and a line
// Repeat     the same triangles for the same segments in the same order

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh/mesh.h"

namespace kiln {

struct Segment {
  Vec2d a, b;
};

class PlaneCut {
 public:
  /// Corners go around counter-clockwise.
  PlaneCut(const std::array<Vec2d, 3>& corner, double near);

  void cut(const Segment&);

  /// Point `id` lies on edge `edge`, which runs from corner `edge` to the next, at `share` of it.
  struct BorderPoint {
    std::uint32_t id;
    int edge;
    double share;
  };
  /// The points on the edges but for the corners, as they came.
  const std::vector<BorderPoint>& border() const { return border_; }
  void move_border_point(std::size_t index, double share);
  std::uint32_t add_border_point(int edge, double share);

  /// Points 0, 1 and 2 are the corners.
  const std::vector<Vec2d>& points() const { return points_; }
  /// Covers the triangle without a hanging point. Counter-clockwise.
  std::vector<Triangle> triangles();
  /// Whether the way from one point to another runs along a segment.
  bool along_segment(std::uint32_t p, std::uint32_t q) const;

 private:
  using Ring = std::vector<std::uint32_t>;  // convex; three in a line are allowed
  struct Crossing {
    std::size_t after;  // on the edge that starts at this place of the ring, or at it
    bool at_point;
    double along;  // the segment, in its lengths
  };

  Vec2d on_edge(int edge, double share) const;
  std::uint32_t known_point(const Vec2d&) const;  // or how many there are
  std::uint32_t point_at(const Vec2d&);
  std::vector<Crossing> crossings(const Ring&, const Segment&) const;
  void cut_ring(std::size_t ring, const Segment&, std::span<const Crossing>);
  Ring with_hanging_points(const Ring&) const;
  bool leaves_area(const Ring&, std::size_t without) const;
  void clip_ears(Ring, std::vector<Triangle>& out) const;

  double near_;
  std::vector<Vec2d> points_;
  std::vector<BorderPoint> border_;
  std::vector<Ring> rings_;
  std::vector<Segment> segments_;
};

}  // namespace kiln
