// The metric against the paper's words: equation 7 term by term, with extrapolation at directions and quadrature.

#include "core/lightfield/collapse_cost.h"

#include <gtest/gtest.h>

#include <numbers>

#include "core/lightfield/radiance_function.h"
#include "core/mesh/topology.h"
#include "core/sphere/quadrature.h"
#include "tests/core/lightfield/lit_models.h"
#include "tests/core/lightfield/random_radiance.h"

namespace kiln {
namespace {

constexpr int kDegree = 3;

/// Hills with random light of all bands.
LitMesh noisy_hills(std::uint64_t seed) {
  LitMesh lit = testing::sheet(6, testing::hills, testing::grey, kDegree);
  Random random(seed, 1);
  for (float& c : lit.field.coefficients) c += random.uniform() - 0.5F;
  for (Vec3f& n : lit.mesh.normal)
    n = normalized(n + Vec3f{random.uniform() - 0.5F, random.uniform() - 0.5F, random.uniform() - 0.5F});
  return lit;
}

RadianceFunction function_of(const LitMesh& lit, std::uint32_t v) {
  const auto c = lit.field.of(v);
  return {.degree = kDegree, .normal = normalized(to_double(lit.mesh.normal[v])), .coefficients = {c.begin(), c.end()}};
}

/// Value of the series itself: what equation 5 integrates, without what is below a corner's own horizon.
Vec3d value(const RadianceFunction& f, const Vec3d& w) {
  std::array<double, 16> y;
  evaluate_sh(kDegree + 1, w, y.data());
  Vec3d out;
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t i = 0; i < 16; ++i) out[c] += f.coefficients[16 * c + i] * y[i];
  return out;
}

/// 1/(2 pi) integral over the hemisphere of n of |f(w)|^2.
template <class Function>
double mean_square(const Vec3d& n, const Function& f) {
  const Basis<double> frame = basis_around(n);
  double sum = 0;
  for (const QuadratureNode& node : gauss_legendre(kDegree + 1)) {
    const double z = 0.5 * (node.x + 1), radius = std::sqrt(1 - z * z);
    for (int k = 0; k < 2 * kDegree + 1; ++k) {
      const double phi = 2 * std::numbers::pi * k / (2 * kDegree + 1);
      const Vec3d x = f(frame.to_world({radius * std::cos(phi), radius * std::sin(phi), z}));
      sum += 0.5 * node.weight / (2 * kDegree + 1) * dot(x, x);
    }
  }
  return sum;
}

/// Equation 7 for v0, whose triangles have it at `place` with the light `moved` after the collapse with `partner`.
double slow_error(const LitMesh& lit, std::uint32_t v0, std::uint32_t partner, const Vec3d& place,
                  const RadianceFunction& moved) {
  const RadianceFunction own = function_of(lit, v0);
  const Vec3d p0 = to_double(lit.mesh.position[v0]);
  double sum = 0;
  for (const Triangle& t : lit.mesh.triangles) {
    const auto at = std::ranges::find(t, v0);
    if (at == t.end() || std::ranges::find(t, partner) != t.end()) continue;
    const auto c = static_cast<std::size_t>(at - t.begin());
    const std::uint32_t a = t[(c + 1) % 3], b = t[(c + 2) % 3];
    const std::array<Vec3d, 3> corner{place, to_double(lit.mesh.position[a]), to_double(lit.mesh.position[b])};
    const RadianceFunction f[] = {moved, function_of(lit, a), function_of(lit, b)};
    // Equation 4 by its gradient (3), J (J^T J)^-1 written out.
    const Vec3d u = corner[1] - corner[0], v = corner[2] - corner[0], d = p0 - corner[0];
    const double uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), det = uu * vv - uv * uv;
    const double s = (vv * dot(u, d) - uv * dot(v, d)) / det, r = (uu * dot(v, d) - uv * dot(u, d)) / det;
    sum += 0.5 * length(cross(u, v)) * mean_square(own.normal, [&](const Vec3d& w) {
             const Vec3d first = value(f[0], w);
             return first + (value(f[1], w) - first) * s + (value(f[2], w) - first) * r - value(own, w);
           });
  }
  return sum;
}

/// Mean |L|^2 times the area: what light errors are relative to.
double light_of(const LitMesh& lit) {
  double sum = 0;
  for (const Triangle& t : lit.mesh.triangles) {
    for (const std::uint32_t v : t) {
      const RadianceFunction f = function_of(lit, v);
      sum += triangle_area(lit.mesh, t) / 3 * mean_square(f.normal, [&](const Vec3d& w) { return value(f, w); });
    }
  }
  return sum;
}

struct Costs {
  LitMesh lit;
  SurfacePoints points;
  CollapseMesh mesh;
  CollapseCost cost;

  Costs(LitMesh of, double geometry_weight, Collapse how)
      : lit(std::move(of)), points(find_surface_points(lit)), mesh(lit, points), cost(mesh, geometry_weight, how) {
    for (std::uint32_t p = 0; p < mesh.points(); ++p) cost.update_point(p);
    for (std::uint32_t v = 0; v < lit.mesh.position.size(); ++v) cost.update_vertex(v);
  }
};

/// Calls visit(plan) for every possible edge.
template <class Visit>
void each_plan(Costs& c, const Visit& visit) {
  for (std::uint32_t p = 0; p < c.mesh.points(); ++p) {
    const std::vector<std::uint32_t> ring = c.mesh.ring(p);
    for (const std::uint32_t q : ring) {
      const CollapsePlan plan = c.cost.plan(p, q);
      if (p < q && plan.possible) visit(plan);
    }
  }
}

TEST(CollapseCost, OfAHalfEdgeIsEquationSeven) {
  Costs c(noisy_hills(1), 0, Collapse::half_edge);
  const double light = light_of(c.lit);
  int plans = 0;
  each_plan(c, [&](const CollapsePlan& plan) {
    const std::uint32_t v = plan.sides.from[0], w = plan.sides.to[0];
    const double slow = slow_error(c.lit, v, w, to_double(plan.place), function_of(c.lit, w)) / light;
    EXPECT_NEAR(plan.cost, slow, 1e-5 * slow);  // Gram matrices are kept in float, thin triangles weigh them by tens
    ++plans;
  });
  EXPECT_GT(plans, 80);
}

TEST(CollapseCost, OfAnEdgeIsEquationSevenAtBothEnds) {
  Costs c(noisy_hills(2), 0, Collapse::edge);
  const double light = light_of(c.lit);
  int moved = 0;
  each_plan(c, [&](const CollapsePlan& plan) {
    if (!plan.moves) return;
    const std::uint32_t v = plan.sides.from[0], w = plan.sides.to[0];
    RadianceFunction between = function_of(c.lit, v);
    const RadianceFunction other = function_of(c.lit, w);
    for (std::size_t i = 0; i < between.coefficients.size(); ++i)
      between.coefficients[i] += plan.share * (other.coefficients[i] - between.coefficients[i]);
    const Vec3d place = to_double(plan.place);
    const double slow = (slow_error(c.lit, v, w, place, between) + slow_error(c.lit, w, v, place, between)) / light;
    EXPECT_NEAR(plan.cost, slow, 1e-5 * slow);
    // Section 4.3: the share is where the place falls onto the edge.
    const Vec3d from = to_double(c.lit.mesh.position[v]), edge = to_double(c.lit.mesh.position[w]) - from;
    EXPECT_NEAR(plan.share, std::clamp(dot(place - from, edge) / dot(edge, edge), 0.0, 1.0), 1e-5);
    ++moved;
  });
  EXPECT_GT(moved, 5);
}

TEST(CollapseCost, ShapeIsAreaTimesSquaredDistanceFromThePlanesAround) {
  Costs c(noisy_hills(3), 1, Collapse::half_edge);
  Vec3f low = c.lit.mesh.position[0], high = low;
  for (const Vec3f& p : c.lit.mesh.position)
    for (std::size_t a = 0; a < 3; ++a) low[a] = std::min(low[a], p[a]), high[a] = std::max(high[a], p[a]);
  const Vec3d across = to_double(high) - to_double(low);
  const double unit = 0.005 * 0.005 * dot(across, across);
  each_plan(c, [&](const CollapsePlan& plan) {
    if (c.mesh.kind(plan.gone) != PointKind::free || c.mesh.kind(plan.kept) != PointKind::free) return;  // no borders
    const Vec3d place = to_double(plan.place);
    double sum = 0;
    for (const std::uint32_t v : {plan.sides.from[0], plan.sides.to[0]}) {
      for (const Triangle& t : c.lit.mesh.triangles) {
        if (std::ranges::find(t, v) == t.end()) continue;
        const Vec3d n = to_double(area_vector(c.lit.mesh, t));
        const double distance = dot(n, place - to_double(c.lit.mesh.position[t[0]])) / length(n);
        sum += 0.5 * length(n) * distance * distance;
      }
    }
    const double slow = sum / (unit * surface_area(c.lit.mesh));
    EXPECT_NEAR(plan.cost, slow, 1e-4 * slow + 1e-12);  // area vectors here are of floats
  });
}

TEST(CollapseCost, DiffuseLightIsColourErrorTimesArea) {
  // Section 4.2, figure 4: a vertex whose colour lies on the plane of its triangles' colours costs nothing to remove.
  const auto linear = [](const Vec3f& p) { return Vec3f{1 + p.x, 1 - p.y, 0.5F + p.x + p.y}; };
  Costs c(testing::sheet(6, testing::flat, linear, kDegree), 0, Collapse::half_edge);
  // Products are kept in floats: 6e-8 of a squared difference of 1/6 over a tenth of the area.
  each_plan(c, [](const CollapsePlan& plan) { EXPECT_LT(plan.cost, 5e-10); });
}

}  // namespace
}  // namespace kiln
