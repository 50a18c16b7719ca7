#include "core/prt/cut_line.h"

#include <algorithm>
#include <tuple>

namespace kiln {

TrianglePlane::TrianglePlane(const Mesh& mesh, const Triangle& t) {
  const Vec3d a = to_double(mesh.position[t[0]]), b = to_double(mesh.position[t[1]]),
              c = to_double(mesh.position[t[2]]);
  origin = a;
  x = normalized(b - a);
  z = normalized(cross(b - a, c - a));
  y = cross(z, x);
}

std::array<Vec2d, 3> flat_corners(const Mesh& mesh, const Triangle& t, const TrianglePlane& plane) {
  std::array<Vec2d, 3> out;
  for (std::size_t k = 0; k < 3; ++k) out[k] = plane.flat(to_double(mesh.position[t[k]]));
  return out;
}

double lit_side(const Mesh& mesh, const Triangle& t, const TrianglePlane& plane) {
  return dot(to_double(mesh.normal[t[0]] + mesh.normal[t[1]] + mesh.normal[t[2]]), plane.z) < 0 ? -1 : 1;
}

bool is_too_small(const std::array<Vec2d, 3>& corner) {
  const Vec2d b = corner[1] - corner[0], c = corner[2] - corner[0];
  return !(cross(b, c) > 16 * kSamePlace * std::max({length(b), length(c), length(c - b)}));  // its smallest height
}

double length(const CutLine& c) { return length(c.line.b - c.line.a); }

std::optional<Segment> clipped(const Segment& s, const std::array<Vec2d, 3>& corner) {
  double first = 0, last = 1;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec2d way = corner[(k + 1) % 3] - corner[k];
    const auto inside = [&](const Vec2d& at) { return cross(way, at - corner[k]) / length(way) + 0.5 * kSamePlace; };
    const double a = inside(s.a), b = inside(s.b);
    if (a < 0 && b < 0) return std::nullopt;
    if (a < 0) first = std::max(first, a / (a - b));
    if (b < 0) last = std::min(last, a / (a - b));
  }
  if (first >= last) return std::nullopt;
  return Segment{s.a + (s.b - s.a) * first, s.a + (s.b - s.a) * last};
}

std::size_t most_lines(const Mesh& mesh) {
  constexpr std::size_t kMost = 256, kFewest = 8, kAll = 1U << 22U;
  return std::clamp(kAll / std::max<std::size_t>(1, mesh.triangles.size()), kFewest, kMost);
}

void keep_longest(std::vector<CutLine>& lines, std::size_t most) {
  const auto key = [](const CutLine& l) { return std::tuple(-length(l), l.line.a.x, l.line.a.y); };
  std::ranges::sort(lines, {}, key);
  lines.resize(std::min(lines.size(), most));
}

std::array<TransferPoint, 2> beside_line(const Mesh& mesh, const CutLine& cut) {
  constexpr double kClear = 3e-5;
  const Triangle& t = mesh.triangles[cut.triangle];
  const TrianglePlane plane(mesh, t);
  const Segment& s = cut.line;
  const Vec2d middle = (s.a + s.b) * 0.5, along = (s.b - s.a) * (kClear / length(cut));
  const Vec2d off{-along.y, along.x};
  const Vec3f face = to_float(plane.z * lit_side(mesh, t, plane));
  std::array<TransferPoint, 2> out;
  for (std::size_t k = 0; k < 2; ++k) {
    const Vec3f at = to_float(plane.in_space(middle + off * (k == 0 ? -1 : 1)));
    out[k] = {.position = at, .normal = face, .inward = at, .face_normal = face};
  }
  return out;
}

}  // namespace kiln
