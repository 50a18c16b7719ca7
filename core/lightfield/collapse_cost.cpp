#include "core/lightfield/collapse_cost.h"

#include <algorithm>
#include <cmath>

#include "core/lightfield/field_lamp.h"
#include "core/lightfield/radiance_function.h"
#include "core/mesh/topology.h"

namespace kiln {
namespace {

// Of the diagonal. So that at the default weight neither light nor shape is paid for with the other: README.md.
constexpr double kLengthUnit = 0.005;
constexpr double kEvenness = 1e-9;  // of squared edge length beside Q: flat regions collapse short edges first

double squared_diagonal(const std::vector<Vec3f>& position) {
  if (position.empty()) return 1;
  Vec3f low = position[0], high = low;
  for (const Vec3f& p : position) {
    for (std::size_t a = 0; a < 3; ++a) low[a] = std::min(low[a], p[a]), high[a] = std::max(high[a], p[a]);
  }
  const Vec3d across = to_double(high) - to_double(low);
  return dot(across, across) > 0 ? dot(across, across) : 1;
}

/// Whether texture coordinates differ on the two sides of an edge.
bool jumps(const std::vector<Vec2f>& uv, const EdgeSides& s) {
  return !uv.empty() && s.triangles == 2 && (uv[s.from[0]] != uv[s.from[1]] || uv[s.to[0]] != uv[s.to[1]]);
}

}  // namespace

CollapseCost::CollapseCost(const CollapseMesh& mesh, double geometry_weight, Collapse how, double mean_square)
    : mesh_(mesh),
      products_(mesh.lit().field),
      how_(how),
      turned_(double{mesh.lit().field.sky_slope} + lamp_slope(mesh.lit().field.lamps)) {
  const Mesh& m = mesh.mesh();
  const double area = surface_area(m);
  double light = mean_square * area;
  for (const Triangle& t : m.triangles) {
    if (mean_square > 0) break;
    const double share = triangle_area(m, t) / 3;
    for (const std::uint32_t v : t) light += share * products_.squared_norm(v, normalized(to_double(m.normal[v])));
  }
  if (area > 0) {
    const double unit = kLengthUnit * kLengthUnit * squared_diagonal(m.position);
    geometry_ = geometry_weight / (unit * area);
    even_ = kEvenness / (unit * area);
    light_ = light > 0 ? (1 - geometry_weight) / light : 0;  // mean |L|^2 is light / area
  }
  quadric_.resize(mesh.points()), area_.resize(mesh.points()), seams_.resize(mesh.points()),
      gram_.resize(m.position.size());
}

void CollapseCost::update_point(std::uint32_t p) {
  if (mesh_.crowded(p)) return;
  Quadric q;
  double area = 0;
  const Vec3d at = mesh_.position(p);
  std::vector<std::uint32_t> neighbours;
  mesh_.around_point(p, [&](std::uint32_t, std::uint32_t, std::uint32_t a, std::uint32_t b) {
    const Vec3d pa = to_double(mesh_.mesh().position[a]), pb = to_double(mesh_.mesh().position[b]);
    const Vec3d across = cross(pa - at, pb - at);
    const double area2 = length(across);
    area += 0.5 * area2;
    if (area2 > 0) q.add_plane(across / area2, dot(across, at) / area2, 0.5 * area2);
    for (const std::uint32_t x : {mesh_.point(a), mesh_.point(b)})
      if (std::ranges::find(neighbours, x) == neighbours.end()) neighbours.push_back(x);
  });
  seams_[p].clear();
  if (mesh_.kind(p) != PointKind::free) {
    const Mesh& mesh = mesh_.mesh();
    for (const std::uint32_t x : neighbours) {
      if (mesh_.kind(x) == PointKind::free) continue;
      const Vec3d other = mesh_.position(x);
      const EdgeSides sides = mesh_.sides(p, x);
      const bool seam = mesh_.kind(p) == PointKind::seam || mesh_.kind(x) == PointKind::seam ||
                        jumps(mesh.uv0, sides) || jumps(mesh.uv1, sides);
      if (sides.triangles == 1 || (sides.crease && seam)) q.add_line(other - at, cross(at, other), kBorderWeight);
      if (!sides.crease || sides.triangles != 2 || sides.from[0] == sides.from[1]) continue;
      const Vec3d normal = normalized(to_double(mesh.normal[sides.from[0]]));
      const double jump = products_.squared_distance(sides.from[0], sides.from[1], normal);
      seams_[p].push_back({x, static_cast<float>(jump)});
    }
  }
  quadric_[p] = q, area_[p] = area;
}

void CollapseCost::update_vertex(std::uint32_t v) {
  if (mesh_.point(v) == SurfacePoints::kNone || mesh_.crowded(mesh_.point(v))) return;
  Gram& g = gram_[v];
  g.ring.clear();
  mesh_.around(v, [&](std::uint32_t, std::uint32_t a, std::uint32_t b) {
    for (const std::uint32_t x : {a, b})
      if (std::ranges::find(g.ring, x) == g.ring.end()) g.ring.push_back(x);
  });
  const Mesh& mesh = mesh_.mesh();
  products_.of_differences(v, g.ring, normalized(to_double(mesh.normal[v])), g.product);
  for (float& product : g.product) product = static_cast<float>(light_ * double{product});
  // A mirror that turns shows another part of the sky, and highlights move.
  add_products(g, v, mesh.normal, light_ * turned_);
  for (const auto* uv : {&mesh.uv0, &mesh.uv1})
    if (!uv->empty()) add_products(g, v, *uv, geometry_ * squared_length_of_unit(g.ring, v, *uv));
}

/// Of differences of an attribute.
template <class Values>
void CollapseCost::add_products(Gram& g, std::uint32_t v, const Values& values, double weight) {
  if (!(weight > 0)) return;
  for (std::size_t i = 0, at = 0; i < g.ring.size(); ++i)
    for (std::size_t k = 0; k <= i; ++k, ++at)
      g.product[at] +=
          static_cast<float>(weight * double{dot(values[g.ring[i]] - values[v], values[g.ring[k]] - values[v])});
}

/// On the surface around v, of a texture coordinate's unit; 0 where all of them are the same.
double CollapseCost::squared_length_of_unit(const std::vector<std::uint32_t>& ring, std::uint32_t v,
                                            const std::vector<Vec2f>& uv) const {
  const std::vector<Vec3f>& position = mesh_.mesh().position;
  double surface = 0, texture = 0;
  for (const std::uint32_t x : ring) {
    surface += double{dot(position[x] - position[v], position[x] - position[v])};
    texture += double{dot(uv[x] - uv[v], uv[x] - uv[v])};
  }
  return texture > 0 ? surface / texture : 0;
}

double CollapseCost::vertex_error(std::uint32_t v, std::uint32_t w, double share, const Vec3d& place) const {
  const Gram& g = gram_[v];
  const auto index = [&](std::uint32_t x) {
    return static_cast<std::size_t>(std::ranges::find(g.ring, x) - g.ring.begin());
  };
  const auto product = [&](std::size_t i, std::size_t k) -> double {
    return g.product[i > k ? i * (i + 1) / 2 + k : k * (k + 1) / 2 + i];
  };
  const auto& position = mesh_.mesh().position;
  const Vec3d at = to_double(position[v]);
  const bool partner = w != SurfacePoints::kNone;
  const std::size_t iw = partner ? index(w) : 0;
  double sum = 0;
  mesh_.around(v, [&](std::uint32_t, std::uint32_t a, std::uint32_t b) {
    if (a == w || b == w) return;
    const std::array<Vec3d, 3> t{place, to_double(position[a]), to_double(position[b])};
    const double area = 0.5 * length(cross(t[1] - t[0], t[2] - t[0]));
    const Vec3d weights = foot_barycentrics(t, at);
    const std::size_t i[] = {iw, index(a), index(b)};
    const double x[] = {partner ? share * weights.x : 0, weights.y, weights.z};
    double squared = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      squared += x[k] * x[k] * product(i[k], i[k]);
      for (std::size_t j = 0; j < k; ++j) squared += 2 * x[k] * x[j] * product(i[k], i[j]);
    }
    sum += area * squared;  // eq. 7
  });
  return std::max(0.0, sum);  // by rounding, or of products free of noise
}

double CollapseCost::seam_error(std::uint32_t p, std::uint32_t other, const Vec3d& place) const {
  const Vec3d from = mesh_.position(p);
  double sum = 0;
  for (const Seam& seam : seams_[p]) {
    if (seam.to == other) continue;
    sum += double{seam.jump} * 0.5 * length(cross(place - from, mesh_.position(seam.to) - from));
  }
  return sum;
}

void CollapseCost::find_cost(CollapsePlan& plan) const {
  const Vec3d place = to_double(plan.place), edge = mesh_.position(plan.kept) - mesh_.position(plan.gone);
  const Quadric q = quadric_[plan.gone] + quadric_[plan.kept];
  double change = 0;
  for (std::uint32_t i = 0; i < plan.sides.pairs; ++i) {
    const std::uint32_t v = plan.sides.from[i], w = plan.sides.to[i];
    change += vertex_error(v, w, plan.share, place);
    if (plan.moves) change += vertex_error(w, v, 1 - plan.share, place);
  }
  mesh_.each_vertex(plan.gone, [&](std::uint32_t v) {
    if (!plan.sides.goes(v)) change += vertex_error(v, SurfacePoints::kNone, 0, place);
  });
  mesh_.each_vertex(plan.kept, [&](std::uint32_t w) {
    if (plan.moves && !plan.sides.takes(w)) change += vertex_error(w, SurfacePoints::kNone, 0, place);
  });
  change += light_ * seam_error(plan.gone, plan.kept, place);
  if (plan.moves) change += light_ * seam_error(plan.kept, plan.gone, place);
  plan.cost = geometry_ * q.at(place) + change;
  plan.order = plan.cost + even_ * (area_[plan.gone] + area_[plan.kept]) * dot(edge, edge);
}

CollapsePlan CollapseCost::plan(std::uint32_t p, std::uint32_t q) const {
  CollapsePlan best;
  if (mesh_.crowded(p) || mesh_.crowded(q)) return best;
  const auto consider = [&](CollapsePlan plan) {
    plan.possible = true;
    find_cost(plan);
    if (!best.possible || plan.order < best.order) best = plan;
  };
  for (const auto& [gone, kept] :
       {std::pair(std::max(p, q), std::min(p, q)), std::pair(std::min(p, q), std::max(p, q))}) {
    const EdgeSides sides = mesh_.sides(gone, kept);
    const auto allowed = mesh_.allowed(gone, kept, sides);
    if (allowed.at_kept)
      consider({.gone = gone, .kept = kept, .place = to_float(mesh_.position(kept)), .sides = sides});
    if (how_ == Collapse::half_edge || !allowed.elsewhere || gone < kept) continue;  // the other way round is the same
    const Vec3d from = mesh_.position(gone), edge = mesh_.position(kept) - from, middle = from + edge * 0.5;
    const Vec3d least = least_point(quadric_[gone] + quadric_[kept], middle);
    if (!(dot(edge, edge) > 0) || length(least - middle) > 2 * length(edge)) continue;
    const double share = std::clamp(dot(least - from, edge) / dot(edge, edge), 0.0, 1.0);  // section 4.3
    consider({.gone = gone,
              .kept = kept,
              .place = to_float(least),
              .share = static_cast<float>(share),
              .moves = true,
              .sides = sides});
  }
  return best;
}

}  // namespace kiln
