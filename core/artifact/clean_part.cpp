#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <unordered_set>

#include "core/artifact/raw_part.h"
#include "core/base/random.h"
#include "core/mesh/topology.h"

namespace kiln {
namespace {

std::string counted(std::uint64_t n, const char* one, const char* many) {
  return std::to_string(n) + " " + (n == 1 ? one : many);
}

/// Before faces are judged: a vertex far out makes its faces look like needles.
bool positions_in_range(const RawPart& part, Findings& findings) {
  constexpr float kMaxCoordinate = 1e18F;
  const auto far = [](const Vec3f& p) {
    return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) > kMaxCoordinate;
  };
  const auto bad = std::find_if(part.position.begin(), part.position.end(), far);
  if (bad == part.position.end()) return true;
  findings.fail("position_out_of_range", "A position is further than 1e18 from the origin.",
                part.place + "/attributes/POSITION element " + std::to_string(bad - part.position.begin()));
  return false;
}

struct TriangleHash {
  std::size_t operator()(const Triangle& t) const { return mix64(mix64(mix64(t[0]) ^ t[1]) ^ t[2]); }
};

/// The same cycle of corners, lowest first: equal for equal faces of equal winding.
Triangle canonical(Triangle t) {
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

void drop_useless_triangles(RawPart& part, Findings& findings) {
  const std::vector<std::uint32_t> welded = weld_by_position(part.position);
  std::unordered_set<Triangle, TriangleHash> seen;
  seen.reserve(part.triangles.size());
  std::uint64_t degenerate = 0, duplicate = 0;
  const auto useless = [&](const Triangle& t) {
    const auto p = [&](int i) { return to_double(part.position[t[static_cast<std::size_t>(i)]]); };
    if (is_degenerate(p(0), p(1), p(2))) return ++degenerate > 0;
    return !seen.insert(canonical({welded[t[0]], welded[t[1]], welded[t[2]]})).second && ++duplicate > 0;
  };
  std::erase_if(part.triangles, useless);
  if (degenerate > 0) {
    findings.warn("degenerate_triangles_dropped", counted(degenerate, "triangle has", "triangles have") + " no area.",
                  part.place);
  }
  if (duplicate > 0) {
    findings.warn("duplicate_triangles_dropped",
                  counted(duplicate, "triangle repeats", "triangles repeat") + " another one.", part.place);
  }
}

/// Makes `part` refer to the old vertices `from`, in that order.
void gather(RawPart& part, const std::vector<std::uint32_t>& from) {
  const auto pick = [&](auto& values) {
    if (values.empty()) return;
    std::remove_reference_t<decltype(values)> out;
    out.reserve(from.size());
    for (const std::uint32_t v : from) out.push_back(values[v]);
    values = std::move(out);
  };
  if (!part.radiance.empty()) {
    const std::size_t width = part.radiance.size() / part.position.size();
    std::vector<float> rows;
    rows.reserve(width * from.size());
    for (const std::uint32_t v : from) {
      const float* row = part.radiance.data() + width * v;
      rows.insert(rows.end(), row, row + width);
    }
    part.radiance = std::move(rows);
  }
  pick(part.position);
  pick(part.normal);
  pick(part.uv0);
  pick(part.uv1);
  pick(part.color);
  pick(part.tangent);
}

/// Without a word: primitives may share one accessor and use a part of it each.
void drop_isolated_vertices(RawPart& part) {
  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> now(part.position.size(), kUnused);
  for (const Triangle& t : part.triangles) {
    for (const std::uint32_t v : t) now[v] = 0;
  }
  std::vector<std::uint32_t> kept;
  for (std::size_t v = 0; v < now.size(); ++v) {
    if (now[v] == kUnused) continue;
    now[v] = static_cast<std::uint32_t>(kept.size());
    kept.push_back(static_cast<std::uint32_t>(v));
  }
  if (kept.size() == now.size()) return;
  for (Triangle& t : part.triangles) {
    for (std::uint32_t& v : t) v = now[v];
  }
  gather(part, kept);
}

Vec3d face(const RawPart& part, const Triangle& t) {
  const Vec3d a = to_double(part.position[t[0]]);
  return cross(to_double(part.position[t[1]]) - a, to_double(part.position[t[2]]) - a);
}

void make_flat_normals(RawPart& part) {
  std::vector<std::uint32_t> corners;
  corners.reserve(part.triangles.size() * 3);
  for (Triangle& t : part.triangles) {
    for (std::uint32_t& v : t) {
      corners.push_back(v);
      v = static_cast<std::uint32_t>(corners.size() - 1);
    }
  }
  gather(part, corners);
  part.normal.resize(corners.size());
  for (const Triangle& t : part.triangles) {
    const Vec3f n = to_float(normalized(face(part, t)));
    for (const std::uint32_t v : t) part.normal[v] = n;
  }
}

/// For each vertex the sum of the area vectors of faces at its position.
std::vector<Vec3d> smooth_directions(const RawPart& part) {
  const std::vector<std::uint32_t> welded = weld_by_position(part.position);
  std::vector<Vec3d> sum(part.position.size());
  for (const Triangle& t : part.triangles) {
    const Vec3d area = face(part, t);
    for (const std::uint32_t v : t) sum[welded[v]] += area;
  }
  for (std::size_t v = 0; v < sum.size(); ++v) sum[v] = sum[welded[v]];
  return sum;
}

void make_smooth_normals(RawPart& part) {
  const std::vector<Vec3d> directions = smooth_directions(part);
  part.normal.clear();
  for (const Vec3d& d : directions) part.normal.push_back(to_float(normalized(d)));
}

/// Where the faces around each vertex look on average; zero if they cancel.
std::vector<Vec3d> facing(const RawPart& part) {
  std::vector<Vec3d> around(part.position.size());
  for (const Triangle& t : part.triangles) {
    const Vec3d area = face(part, t);
    for (const std::uint32_t v : t) around[v] += area;
  }
  for (Vec3d& g : around) g = normalized(g, Vec3d{});
  return around;
}

/// Normals and winding should agree. Where most do not, the winding is taken for the mistake, else the normal:
/// it is mirrored to the front of its faces, n - 2 (n.g) g.
void reconcile_normals(RawPart& part, Findings& findings) {
  std::vector<Vec3d> front = facing(part);
  const auto behind = [&](std::size_t v) { return dot(to_double(part.normal[v]), front[v]); };
  std::uint64_t contradicting = 0;
  for (std::size_t v = 0; v < front.size(); ++v) contradicting += behind(v) < 0 ? 1 : 0;
  if (contradicting > front.size() / 2) {
    for (Triangle& t : part.triangles) std::swap(t[1], t[2]);
    for (Vec3d& g : front) g = -g;
    findings.warn("winding_contradicts_normals", "Most faces are wound against their normals; all are turned round.",
                  part.place);
  }
  std::uint64_t mirrored = 0;
  for (std::size_t v = 0; v < front.size(); ++v) {
    if (behind(v) >= 0) continue;
    part.normal[v] = to_float(normalized(to_double(part.normal[v]) - front[v] * (2 * behind(v)), front[v]));
    ++mirrored;
  }
  if (mirrored > 0) {
    findings.warn("normals_contradict_faces",
                  counted(mirrored, "normal lies", "normals lie") + " behind the face; mirrored to its front.",
                  part.place);
  }
}

void mend_normals(RawPart& part, Findings& findings) {
  constexpr double kTolerance = 0.02;  // 8-bit normals are off by up to 0.007
  std::uint64_t zero = 0, not_unit = 0;
  std::vector<Vec3d> directions;
  for (std::size_t v = 0; v < part.normal.size(); ++v) {
    const Vec3d n = to_double(part.normal[v]);
    const double norm = length(n);
    if (!(norm > 1e-6)) {
      if (directions.empty()) directions = smooth_directions(part);
      part.normal[v] = to_float(normalized(directions[v]));
      ++zero;
      continue;
    }
    not_unit += std::abs(norm - 1) > kTolerance ? 1 : 0;
    part.normal[v] = to_float(n / norm);
  }
  if (zero > 0)
    findings.warn("normals_computed",
                  counted(zero, "normal has", "normals have") + " no direction; made from the faces.", part.place);
  if (not_unit > 0)
    findings.warn("normals_not_unit", counted(not_unit, "normal is", "normals are") + " not of length 1; scaled.",
                  part.place);
  reconcile_normals(part, findings);
}

void mend_tangents(RawPart& part, Findings& findings) {
  for (Vec4f& t : part.tangent) {
    const Vec3d direction = to_double(Vec3f{t.x, t.y, t.z});
    if (!(length(direction) > 1e-6)) {
      findings.warn("tangents_dropped", "Some tangents have no direction; the attribute is left out.", part.place);
      part.tangent.clear();
      return;
    }
    const Vec3f unit = to_float(normalized(direction));
    t = {unit.x, unit.y, unit.z, t.w < 0 ? -1.0F : 1.0F};
  }
}

}  // namespace

bool is_degenerate(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const Vec3d ab = b - a, ac = c - a, bc = c - b;
  const double longest = std::max({dot(ab, ab), dot(ac, ac), dot(bc, bc)});
  return !(length(cross(ab, ac)) > 1e-12 * longest);
}

void clean_part(RawPart& part, MissingNormals missing, Findings& findings) {
  if (!positions_in_range(part, findings)) return;
  drop_useless_triangles(part, findings);
  drop_isolated_vertices(part);
  if (!part.normal.empty()) {
    mend_normals(part, findings);
  } else if (missing == MissingNormals::flat) {
    make_flat_normals(part);
  } else {
    make_smooth_normals(part);
  }
  mend_tangents(part, findings);
}

}  // namespace kiln
