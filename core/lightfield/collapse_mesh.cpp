#include "core/lightfield/collapse_mesh.h"

#include <algorithm>

namespace kiln {
namespace {

constexpr double kTurned = 0.2;  // cosine between a triangle's normals before and after, as in core/reduce/collapse.cpp
constexpr double kNeedle = 0.05;  // 4 sqrt(3) area / sum of squared edges: 1 for an equilateral triangle

double shape(const Vec3d& a, const Vec3d& b, const Vec3d& c, double area2) {
  return 3.4641016151377544 * area2 / (dot(b - a, b - a) + dot(c - b, c - b) + dot(a - c, a - c));
}

}  // namespace

CollapseMesh::CollapseMesh(LitMesh& lit, const SurfacePoints& points) : lit_(lit), point_(points.point) {
  const std::size_t vertices = point_.size();
  left_ = lit.mesh.triangles.size();
  first_vertex_.assign(points.locked.size(), kNone), next_vertex_.assign(vertices, kNone);
  for (auto v = static_cast<std::uint32_t>(vertices); v-- > 0;) {
    if (point_[v] == kNone) continue;
    next_vertex_[v] = first_vertex_[point_[v]];
    first_vertex_[point_[v]] = v;
  }
  head_.assign(vertices, kNone), tail_.assign(vertices, kNone), next_.assign(3 * left_, kNone);
  gone_.assign(left_, false), mark_.assign(first_vertex_.size(), 0);
  for (std::uint32_t corner = 0; corner < 3 * left_; ++corner)
    append(lit.mesh.triangles[corner / 3][corner % 3], corner);
  on_border_.assign(this->points(), false), on_outline_.assign(this->points(), false);
  for (std::uint32_t p = 0; p < this->points(); ++p) kind_.push_back(find_kind(p, points.locked[p]));
}

void CollapseMesh::append(std::uint32_t v, std::uint32_t corner) {
  next_[corner] = kNone;
  if (tail_[v] == kNone) {
    head_[v] = corner;
  } else {
    next_[tail_[v]] = corner;
  }
  tail_[v] = corner;
}

void CollapseMesh::drop_gone(std::uint32_t v) {
  std::uint32_t corner = head_[v];
  head_[v] = tail_[v] = kNone;
  while (corner != kNone) {
    const std::uint32_t following = next_[corner];
    if (!gone_[corner / 3]) append(v, corner);
    corner = following;
  }
}

PointKind CollapseMesh::find_kind(std::uint32_t p, bool locked) {
  if (crowded(p)) return PointKind::locked;
  std::uint32_t borders = 0, seams = 0, vertices = 0;
  for (const std::uint32_t q : ring(p)) {
    const EdgeSides s = sides(p, q);
    if (s.triangles > 2) locked = true;
    if (!s.crease || s.triangles > 2) continue;
    const bool border = s.triangles == 1;
    ++(border ? borders : seams);
    if (border) on_border_[p] = on_border_[q] = true;
    if (s.outline) on_outline_[p] = on_outline_[q] = true;
  }
  if (locked) return PointKind::locked;
  each_vertex(p, [&](std::uint32_t) { ++vertices; });
  if (borders == 0 && seams == 0 && vertices == 1) return PointKind::free;
  if (borders == 2 && seams == 0 && vertices == 1) return PointKind::border;
  if (borders == 0 && seams == 2 && vertices == 2) return PointKind::seam;
  return PointKind::junction;
}

bool CollapseMesh::crowded(std::uint32_t p) const {
  int triangles = 0;
  for (std::uint32_t v = first_vertex_[p]; v != kNone && triangles <= kCrowd; v = next_vertex_[v])
    for (std::uint32_t corner = head_[v]; corner != kNone && triangles <= kCrowd; corner = next_[corner]) ++triangles;
  return triangles > kCrowd;
}

const std::vector<std::uint32_t>& CollapseMesh::ring(std::uint32_t p) {
  ring_.clear();
  ++stamp_;
  around_point(p, [&](std::uint32_t, std::uint32_t, std::uint32_t a, std::uint32_t b) {
    for (const std::uint32_t q : {point_[a], point_[b]}) {
      if (mark_[q] == stamp_) continue;
      mark_[q] = stamp_;
      ring_.push_back(q);
    }
  });
  return ring_;
}

EdgeSides CollapseMesh::sides(std::uint32_t p, std::uint32_t q) const {
  EdgeSides s;
  around_point(p, [&](std::uint32_t t, std::uint32_t v, std::uint32_t a, std::uint32_t b) {
    const std::uint32_t w = point_[a] == q ? a : point_[b] == q ? b : kNone;
    if (w == kNone) return;
    if (s.triangles < 2) s.triangle[s.triangles] = t, s.from[s.triangles] = v, s.to[s.triangles] = w;
    ++s.triangles;
  });
  s.pairs = std::min(s.triangles, 2U);
  if (s.triangles == 2) {
    if (s.from[0] == s.from[1] && s.to[0] == s.to[1]) s.pairs = 1;
    s.outline = part_of(s.triangle[0]) != part_of(s.triangle[1]);
    s.crease = s.pairs == 2 || s.outline;
  } else {
    s.crease = s.outline = true;
  }
  return s;
}

CollapseMesh::Allowed CollapseMesh::allowed(std::uint32_t gone, std::uint32_t kept, const EdgeSides& s) const {
  if (s.triangles == 0 || s.triangles > 2 || kind_[gone] == PointKind::locked) return {};
  if (kind_[gone] == PointKind::free) return {.at_kept = true, .elsewhere = kind_[kept] == PointKind::free};
  const bool split = s.pairs == 2 && s.from[0] == s.from[1], onto_one = s.pairs == 2 && s.to[0] == s.to[1];
  if (split || (on_border_[gone] && s.triangles == 2) || (on_outline_[gone] && !s.outline)) return {};
  return {.at_kept = true, .elsewhere = s.crease && kind_[kept] == kind_[gone] && !onto_one};
}

bool CollapseMesh::next_to(std::uint32_t p, std::uint32_t q) const {
  bool found = false;
  around_point(p, [&](std::uint32_t, std::uint32_t, std::uint32_t a, std::uint32_t b) {
    found |= point_[a] == q || point_[b] == q;
  });
  return found;
}

bool CollapseMesh::keeps_topology(std::uint32_t p, std::uint32_t q, const EdgeSides& s) {
  ring(p);
  common_.clear();
  std::uint32_t triangles = 0;
  const auto is_common = [&](std::uint32_t x) { return std::ranges::find(common_, x) != common_.end(); };
  around_point(q, [&](std::uint32_t, std::uint32_t, std::uint32_t a, std::uint32_t b) {
    ++triangles;
    for (const std::uint32_t x : {point_[a], point_[b]})
      if (x != p && mark_[x] == stamp_ && !is_common(x)) common_.push_back(x);
  });
  if (common_.size() != s.triangles) return false;
  around_point(p, [&](std::uint32_t, std::uint32_t, std::uint32_t, std::uint32_t) { ++triangles; });
  if (triangles <= 2 * s.triangles) return false;  // nothing would be left of this piece
  // p, q, x and y closed to a tetrahedron: its last two triangles would lie on each other.
  if (common_.size() == 2 && next_to(common_[0], common_[1])) {
    bool closed = false;
    around_point(q, [&](std::uint32_t, std::uint32_t, std::uint32_t a, std::uint32_t b) {
      closed |= is_common(point_[a]) && is_common(point_[b]);
    });
    if (closed) return false;
  }
  if (!s.crease) return true;
  return std::ranges::none_of(common_, [&](std::uint32_t x) {
    return kind_[x] != PointKind::free && kind_[x] != PointKind::junction && sides(p, x).crease && sides(q, x).crease;
  });
}

bool CollapseMesh::spoils(std::uint32_t p, std::uint32_t q, const Vec3d& place) const {
  bool bad = false;
  const Vec3d from = position(p);
  const auto& normal = lit_.mesh.normal;
  around_point(p, [&](std::uint32_t, std::uint32_t v, std::uint32_t a, std::uint32_t b) {
    if (bad || point_[a] == q || point_[b] == q) return;
    const Vec3d pa = position(point_[a]), pb = position(point_[b]);
    const Vec3d before = cross(pa - from, pb - from), after = cross(pa - place, pb - place);
    const double was = length(before), is = length(after);
    const Vec3d up = to_double(normal[v] + normal[a] + normal[b]);
    if (was > 0 && (is == 0 || dot(before, after) < kTurned * was * is)) bad = true;
    if (dot(up, after) < 0 && dot(up, before) >= 0) bad = true;
    const double shaped = shape(place, pa, pb, is);
    if (shaped < kNeedle && shaped < shape(from, pa, pb, was)) bad = true;
  });
  return bad;
}

/// Vertices of `gone` without a partner become vertices of `kept`.
void CollapseMesh::carry_rest(std::uint32_t gone, std::uint32_t kept, const EdgeSides& s) {
  std::uint32_t last = first_vertex_[kept];
  while (next_vertex_[last] != kNone) last = next_vertex_[last];
  for (std::uint32_t v = first_vertex_[gone], next = kNone; v != kNone; v = next) {
    next = next_vertex_[v];
    next_vertex_[v] = kNone;
    if (s.goes(v)) continue;
    point_[v] = kept;
    last = next_vertex_[last] = v;
  }
  first_vertex_[gone] = kNone;
  if (on_border_[gone]) on_border_[kept] = true;
  if (on_outline_[gone]) on_outline_[kept] = true;
  const bool meets = kind_[gone] == PointKind::junction || (kind_[gone] != PointKind::free && !s.crease);
  if (meets && kind_[kept] != PointKind::locked) kind_[kept] = PointKind::junction;
}

void CollapseMesh::drop_orphan(std::uint32_t v) {
  if (head_[v] != kNone || std::ranges::find(joined_.orphans, v) != joined_.orphans.end()) return;
  joined_.orphans.push_back(v);
  std::uint32_t* link = &first_vertex_[point_[v]];
  while (*link != v) link = &next_vertex_[*link];
  *link = next_vertex_[v];
  next_vertex_[v] = kNone;
}

const CollapseMesh::Joined& CollapseMesh::join(std::uint32_t gone, std::uint32_t kept, const EdgeSides& s) {
  for (std::uint32_t i = 0; i < s.triangles; ++i) gone_[s.triangle[i]] = true, --left_;
  std::array<std::uint32_t, 2> others{};  // across from the edge
  for (std::uint32_t i = 0; i < s.triangles; ++i)
    for (const std::uint32_t v : lit_.mesh.triangles[s.triangle[i]])
      if (v != s.from[i] && v != s.to[i]) others[i] = v;
  joined_.turned.clear(), joined_.orphans.clear();
  for (std::uint32_t i = 0; i < s.pairs; ++i) {
    const std::uint32_t v = s.from[i], w = s.to[i];
    std::uint32_t corner = head_[v];
    head_[v] = tail_[v] = kNone;
    while (corner != kNone) {
      const std::uint32_t following = next_[corner];
      if (!gone_[corner / 3]) {
        lit_.mesh.triangles[corner / 3][corner % 3] = w;
        append(w, corner);
        joined_.turned.push_back(2 * (corner / 3) + i);
      }
      corner = following;
    }
    drop_gone(w);
  }
  for (std::uint32_t i = 0; i < s.triangles; ++i) drop_gone(others[i]), drop_gone(s.to[i]);
  carry_rest(gone, kept, s);
  for (std::uint32_t i = 0; i < s.triangles; ++i) drop_orphan(others[i]), drop_orphan(s.to[i]);
  return joined_;
}

}  // namespace kiln
