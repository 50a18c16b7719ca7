#include "core/prt/shadow_lines.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/mesh/topology.h"
#include "core/prt/ray_origin.h"
#include "core/trace/lights.h"

namespace kiln {
namespace {

constexpr double kAside = 3e-6;      // unit cube: how far beside an edge rays pass it
constexpr double kBehind = 1e-5;     // what is hit before is the edge's own neighbourhood
constexpr std::size_t kSamples = 9;  // of an edge at first,
constexpr int kHalvings = 5;         // and so often between two that differ

/// An edge and the corners opposite to it of all triangles that share it, by position.
struct Edge {
  Vec3d p, q;
  std::vector<Vec3d> opposite;
};

std::vector<Edge> edges_of(const Mesh& mesh, const std::vector<bool>& casts) {
  const std::vector<std::uint32_t> place = weld_by_position(mesh.position);
  struct Side {
    std::uint32_t p, q, opposite;
  };
  std::vector<Side> sides;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!casts[t]) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const Triangle& c = mesh.triangles[t];
      const auto [p, q] = std::minmax(place[c[k]], place[c[(k + 1) % 3]]);
      if (p != q) sides.push_back({p, q, place[c[(k + 2) % 3]]});
    }
  }
  std::ranges::sort(sides, {}, [](const Side& s) { return std::tuple(s.p, s.q, s.opposite); });
  const auto at = [&](std::uint32_t place_of) { return to_double(mesh.position[place_of]); };
  std::vector<Edge> out;
  for (std::size_t i = 0; i < sides.size(); ++i) {
    if (i == 0 || sides[i].p != sides[i - 1].p || sides[i].q != sides[i - 1].q)
      out.push_back({at(sides[i].p), at(sides[i].q), {}});
    out.back().opposite.push_back(at(sides[i].opposite));
  }
  return out;
}

/// Light that passes an edge.
struct Beam {
  const Light& light;

  /// The way light travels at a point, unit.
  Vec3d direction(const Vec3d& at) const {
    return light.type == LightType::directional ? normalized(to_double(light.direction))
                                                : normalized(at - to_double(light.position));
  }
  double distance(const Vec3d& at) const {
    return light.type == LightType::directional ? kFar : length(at - to_double(light.position));
  }
};

/// The direction across the light away from the edge's faces; nothing where they lie on both sides of it.
std::optional<Vec3d> outside(const Edge& e, const Beam& beam) {
  const Vec3d middle = (e.p + e.q) * 0.5, across = cross(e.q - e.p, beam.direction(middle));
  if (!(length(across) > 1e-3 * length(e.q - e.p))) return std::nullopt;  // it points at the light
  const Vec3d n = normalized(across);
  bool left = false, right = false;
  for (const Vec3d& corner : e.opposite) {
    const double side = dot(corner - e.p, n);
    if (std::abs(side) < kSamePlace) continue;
    (side < 0 ? left : right) = true;
  }
  if (left == right) return std::nullopt;
  return left ? n : n * -1.0;
}

/// The triangle that light falls on past a point of an edge, or kNoHit.
class Falls {
 public:
  Falls(const Tracer& tracer, const Edge& e, const Beam& beam, const Vec3d& aside)
      : tracer_(tracer), edge_(e), beam_(beam), aside_(aside) {}

  std::uint32_t operator()(double share) const {
    const Vec3d at = edge_.p + (edge_.q - edge_.p) * std::clamp(share, 1e-4, 1 - 1e-4) + aside_ * kAside;
    const Vec3f way = to_float(beam_.direction(at)), from = to_float(at);
    if (tracer_.occluded(from, way * -1.0F, static_cast<float>(beam_.distance(at) * (1 - 1e-6)))) return kNoHit;
    const Hit hit = tracer_.closest(from, way, kFar);
    return hit && hit.t > kBehind ? hit.triangle : kNoHit;
  }

 private:
  const Tracer& tracer_;
  const Edge& edge_;
  const Beam& beam_;
  Vec3d aside_;
};

/// Part of an edge past which light falls on one triangle.
struct Run {
  double first, last;
  std::uint32_t triangle;
};

struct Sample {
  double share;
  std::uint32_t triangle;
};

void refine(const Falls& falls, const Sample& a, const Sample& b, int halvings, std::vector<Sample>& out) {
  if (a.triangle != b.triangle && halvings > 0) {
    const double share = 0.5 * (a.share + b.share);
    const Sample middle{share, falls(share)};
    refine(falls, a, middle, halvings - 1, out);
    refine(falls, middle, b, halvings - 1, out);
    return;
  }
  out.push_back(b);
}

/// A little longer than they are: to the next sample that another triangle has.
std::vector<Run> runs(const Falls& falls) {
  std::vector<Sample> samples{{0, falls(0)}};
  for (std::size_t i = 1; i < kSamples; ++i) {
    const double share = static_cast<double>(i) / (kSamples - 1);
    const Sample last = samples.back();
    refine(falls, last, {share, falls(share)}, kHalvings, samples);
  }
  std::vector<Run> out;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples[i].triangle == kNoHit) continue;
    const double before = samples[i == 0 ? 0 : i - 1].share, after = samples[std::min(i + 1, samples.size() - 1)].share;
    if (i > 0 && samples[i - 1].triangle == samples[i].triangle) {
      out.back().last = after;
    } else {
      out.push_back({before, after, samples[i].triangle});
    }
  }
  return out;
}

/// The shadow of a part of an edge on a triangle, where the triangle is lit.
std::optional<CutLine> line_of(const Mesh& mesh, const Edge& e, const Beam& beam, const Run& run) {
  const Triangle& t = mesh.triangles[run.triangle];
  const TrianglePlane plane(mesh, t);
  const std::array<Vec2d, 3> corner = flat_corners(mesh, t, plane);
  if (is_too_small(corner)) return std::nullopt;
  const double side = lit_side(mesh, t, plane);
  std::array<Vec2d, 2> end;
  for (std::size_t k = 0; k < 2; ++k) {
    const Vec3d at = e.p + (e.q - e.p) * (k == 0 ? run.first : run.last), way = beam.direction(at);
    const double height = side * dot(at - plane.origin, plane.z) - kHair, fall = -side * dot(way, plane.z);
    if (!(fall > 1e-3) || !(height > 0)) return std::nullopt;  // it grazes, or comes from behind
    end[k] = plane.flat(at + way * (height / fall));
  }
  const auto line = clipped({end[0], end[1]}, corner);
  if (!line || !(length(line->b - line->a) > 2 * kSamePlace)) return std::nullopt;
  const Vec3d arrives = light_arrival(beam.light, plane.in_space((line->a + line->b) * 0.5)).irradiance;
  if (!(arrives.x > 0 || arrives.y > 0 || arrives.z > 0)) return std::nullopt;
  return CutLine{run.triangle, *line};
}

}  // namespace

std::vector<CutLine> find_shadow_lines(const Tracer& tracer, const std::vector<bool>& casts, Threads& threads) {
  constexpr std::size_t kBlock = 256;
  const Scene& scene = tracer.scene();
  if (scene.lights.empty()) return {};
  const std::vector<Edge> edges = edges_of(scene.mesh, casts);
  std::vector<std::vector<CutLine>> of_block(edges.size() / kBlock + 1);
  threads.for_blocks(edges.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      for (const Light& light : scene.lights) {
        const Beam beam{light};
        const auto aside = outside(edges[i], beam);
        if (!aside) continue;
        for (const Run& run : runs(Falls(tracer, edges[i], beam, *aside))) {
          if (const auto line = line_of(scene.mesh, edges[i], beam, run)) of_block[begin / kBlock].push_back(*line);
        }
      }
    }
  });
  std::vector<CutLine> all;
  for (const auto& block : of_block) all.insert(all.end(), block.begin(), block.end());
  std::ranges::stable_sort(all, {}, &CutLine::triangle);

  std::vector<CutLine> out, of_triangle;
  for (std::size_t i = 0; i < all.size(); ++i) {
    of_triangle.push_back(all[i]);
    if (i + 1 < all.size() && all[i + 1].triangle == all[i].triangle) continue;
    keep_longest(of_triangle, most_lines(scene.mesh));
    out.insert(out.end(), of_triangle.begin(), of_triangle.end());
    of_triangle.clear();
  }
  return out;
}

}  // namespace kiln
