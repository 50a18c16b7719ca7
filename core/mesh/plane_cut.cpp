#include "core/mesh/plane_cut.h"

#include <algorithm>
#include <cmath>

namespace kiln {
namespace {

/// Where p lies beside the way from a to b: along it in its lengths, and off it.
struct Beside {
  double along, off;
};

Beside beside(const Vec2d& p, const Vec2d& a, const Vec2d& b) {
  const Vec2d way = b - a;
  const double size = length(way);
  return {dot(p - a, way) / (size * size), cross(way, p - a) / size};
}

double twice_area(const Vec2d& a, const Vec2d& b, const Vec2d& c) { return cross(b - a, c - a); }

}  // namespace

PlaneCut::PlaneCut(const std::array<Vec2d, 3>& corner, double near)
    : near_(near), points_(corner.begin(), corner.end()), rings_{{0, 1, 2}} {}

Vec2d PlaneCut::on_edge(int edge, double share) const {
  const Vec2d &a = points_[static_cast<std::size_t>(edge)], &b = points_[static_cast<std::size_t>((edge + 1) % 3)];
  return a + (b - a) * share;
}

std::uint32_t PlaneCut::known_point(const Vec2d& place) const {
  std::uint32_t p = 0;
  while (p < points_.size() && length(points_[p] - place) >= near_) ++p;
  return p;
}

std::uint32_t PlaneCut::point_at(const Vec2d& place) {
  const std::uint32_t known = known_point(place);
  if (known < points_.size()) return known;
  for (int edge = 0; edge < 3; ++edge) {
    const Beside at = beside(place, on_edge(edge, 0), on_edge(edge, 1));
    if (at.along > 0 && at.along < 1 && std::abs(at.off) < near_) return add_border_point(edge, at.along);
  }
  points_.push_back(place);
  return known;
}

std::uint32_t PlaneCut::add_border_point(int edge, double share) {
  const Vec2d place = on_edge(edge, share);
  const std::uint32_t point = known_point(place);
  const bool known = point < points_.size();
  if (known && (point < 3 || std::ranges::any_of(border_, [&](const BorderPoint& b) { return b.id == point; })))
    return point;
  known ? points_[point] = place : points_.emplace_back(place);
  border_.push_back({point, edge, share});
  return point;
}

void PlaneCut::move_border_point(std::size_t index, double share) {
  border_[index].share = share;
  points_[border_[index].id] = on_edge(border_[index].edge, share);
}

/// Where the line of a segment goes in and out of a ring: two places, or none where it only touches.
std::vector<PlaneCut::Crossing> PlaneCut::crossings(const Ring& ring, const Segment& s) const {
  std::vector<Beside> at;
  for (const std::uint32_t p : ring) at.push_back(beside(points_[p], s.a, s.b));
  const auto side = [&](std::size_t i) { return at[i].off > near_ ? 1 : at[i].off < -near_ ? -1 : 0; };
  std::vector<Crossing> out;
  bool left = false, right = false;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const std::size_t next = (i + 1) % ring.size();
    left = left || side(i) > 0;
    right = right || side(i) < 0;
    if (side(i) == 0) out.push_back({i, true, at[i].along});
    if (side(i) * side(next) < 0) {
      const double share = at[i].off / (at[i].off - at[next].off);
      out.push_back({i, false, at[i].along + (at[next].along - at[i].along) * share});
    }
  }
  if (!left || !right || out.size() != 2) out.clear();
  return out;
}

void PlaneCut::cut(const Segment& wanted) {
  if (length(wanted.b - wanted.a) < 2 * near_) return;
  const std::uint32_t a = point_at(wanted.a), b = point_at(wanted.b);
  if (a == b) return;
  const Segment s{points_[a], points_[b]};
  segments_.push_back(s);
  const double little = near_ / length(s.b - s.a);
  for (std::size_t ring = 0, rings = rings_.size(); ring < rings; ++ring) {
    const std::vector<Crossing> crossing = crossings(rings_[ring], s);
    if (crossing.empty()) continue;
    const auto [first, last] = std::minmax(crossing[0].along, crossing[1].along);
    if (std::min(last, 1.0) - std::max(first, 0.0) > little) cut_ring(ring, s, crossing);
  }
}

/// Parts a ring into what lies between its crossings, and the rest.
void PlaneCut::cut_ring(std::size_t index, const Segment& s, std::span<const Crossing> crossing) {
  const Ring ring = rings_[index];
  std::array<std::uint32_t, 2> at{};
  for (std::size_t k = 0; k < 2; ++k) {
    const std::uint32_t p = ring[crossing[k].after], q = ring[(crossing[k].after + 1) % ring.size()];
    if (crossing[k].at_point) {
      at[k] = p;
      continue;
    }
    const double off_p = beside(points_[p], s.a, s.b).off, off_q = beside(points_[q], s.a, s.b).off;
    at[k] = point_at(points_[p] + (points_[q] - points_[p]) * (off_p / (off_p - off_q)));
  }
  if (at[0] == at[1]) return;

  Ring inner{at[0]}, outer{at[1]};
  for (std::size_t i = crossing[0].after + 1; i <= crossing[1].after; ++i) inner.push_back(ring[i]);
  inner.push_back(at[1]);
  for (std::size_t i = crossing[1].after + 1; i <= ring.size() + crossing[0].after; ++i)
    outer.push_back(ring[i % ring.size()]);
  outer.push_back(at[0]);
  for (Ring* r : {&inner, &outer}) {
    r->erase(std::unique(r->begin(), r->end()), r->end());
    if (r->size() > 1 && r->front() == r->back()) r->pop_back();
  }
  if (inner.size() < 3 || outer.size() < 3) return;
  rings_[index] = std::move(inner);
  rings_.push_back(std::move(outer));
}

bool PlaneCut::along_segment(std::uint32_t p, std::uint32_t q) const {
  const Vec2d middle = (points_[p] + points_[q]) * 0.5;
  return std::ranges::any_of(segments_, [&](const Segment& s) {
    const Beside at = beside(middle, s.a, s.b);
    const double off_p = beside(points_[p], s.a, s.b).off, off_q = beside(points_[q], s.a, s.b).off;
    return at.along > 0 && at.along < 1 && std::max(std::abs(off_p), std::abs(off_q)) < 2 * near_;
  });
}

PlaneCut::Ring PlaneCut::with_hanging_points(const Ring& ring) const {
  Ring out;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const std::uint32_t p = ring[i], q = ring[(i + 1) % ring.size()];
    std::vector<std::pair<double, std::uint32_t>> between;
    for (std::uint32_t r = 0; r < points_.size(); ++r) {
      if (std::ranges::find(ring, r) != ring.end()) continue;
      const Beside at = beside(points_[r], points_[p], points_[q]);
      if (at.along > 0 && at.along < 1 && std::abs(at.off) < near_) between.emplace_back(at.along, r);
    }
    std::ranges::sort(between);
    out.push_back(p);
    for (const auto& [along, r] : between) out.push_back(r);
  }
  return out;
}

/// Whether what is left without corner i is more than a line.
bool PlaneCut::leaves_area(const Ring& ring, std::size_t i) const {
  const std::size_t n = ring.size();
  const Vec2d& from = points_[ring[(i + 1) % n]];
  double twice = 0, longest = 0;
  for (std::size_t k = 2; k < n; ++k) {
    const Vec2d &p = points_[ring[(i + k - 1) % n]], &q = points_[ring[(i + k) % n]];
    twice += twice_area(from, p, q);
    longest = std::max(longest, length(q - from));
  }
  return twice > 2 * near_ * longest;
}

/// The widest ear first: the one whose smallest height is the largest share of its longest side. Points in a line
/// make ears of no area, which wait until a side of theirs is gone.
void PlaneCut::clip_ears(Ring ring, std::vector<Triangle>& out) const {
  while (ring.size() >= 3) {
    std::size_t best = 0;
    double best_shape = -1;
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Vec2d &a = points_[ring[(i + ring.size() - 1) % ring.size()]], &b = points_[ring[i]],
                  &c = points_[ring[(i + 1) % ring.size()]];
      const double longest = std::max({dot(b - a, b - a), dot(c - b, c - b), dot(a - c, a - c)});
      const double shape = longest > 0 ? twice_area(a, b, c) / longest : 0;
      if (shape > best_shape && (ring.size() == 3 || leaves_area(ring, i))) best = i, best_shape = shape;
    }
    const std::size_t before = (best + ring.size() - 1) % ring.size(), after = (best + 1) % ring.size();
    if (best_shape > 0) out.push_back({ring[before], ring[best], ring[after]});
    ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(best));
  }
}

std::vector<Triangle> PlaneCut::triangles() {
  std::vector<Triangle> out;
  for (const Ring& ring : rings_) clip_ears(with_hanging_points(ring), out);
  return out;
}

}  // namespace kiln
