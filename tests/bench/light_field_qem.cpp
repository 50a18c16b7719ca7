// Garland and Heckbert 1998, "Simplifying surfaces with color and texture using quadric error metrics", on six numbers:
// position and mean colour.

#include <Eigen/Cholesky>
#include <cmath>

#include "core/lightfield/collapse_mesh.h"
#include "core/lightfield/mean_radiance.h"
#include "core/mesh/collapse_queue.h"
#include "core/mesh/topology.h"
#include "tests/bench/light_field_compare.h"

namespace kiln::bench {
namespace {

using Vec6 = Eigen::Matrix<double, 6, 1>;

struct Quadric6 {
  Eigen::Matrix<double, 6, 6> a = Eigen::Matrix<double, 6, 6>::Zero();
  Vec6 b = Vec6::Zero();
  double c = 0;
  double at(const Vec6& v) const { return v.dot(a * v) + 2 * b.dot(v) + c; }
  Quadric6& operator+=(const Quadric6& o) {
    a += o.a, b += o.b, c += o.c;
    return *this;
  }
  /// Squared distance from the plane through p, q, r in six dimensions (their section 2.2).
  void add_triangle(const Vec6& p, const Vec6& q, const Vec6& r, double weight) {
    Vec6 e1 = q - p;
    if (!(e1.norm() > 0)) return;
    e1.normalize();
    Vec6 e2 = r - p - e1 * e1.dot(r - p);
    if (!(e2.norm() > 0)) return;
    e2.normalize();
    a += weight * (Eigen::Matrix<double, 6, 6>::Identity() - e1 * e1.transpose() - e2 * e2.transpose());
    b += weight * (e1 * p.dot(e1) + e2 * p.dot(e2) - p);
    c += weight * (p.dot(p) - p.dot(e1) * p.dot(e1) - p.dot(e2) * p.dot(e2));
  }
};

/// Mean colours as parts of their RMS.
std::vector<Vec3d> mean_colours(const LitMesh& lit) {
  std::vector<Vec3d> out;
  for (const Vec3f& colour : mean_radiance(lit.field, lit.mesh.normal)) out.push_back(to_double(colour));
  double squares = 0;
  for (const Vec3d& c : out) squares += dot(c, c);
  const double rms = std::sqrt(squares / static_cast<double>(out.size()));
  for (Vec3d& c : out) c = c / (rms > 0 ? rms : 1);
  return out;
}

/// For welded meshes without seams: a point is a vertex.
class ColourQem {
 public:
  ColourQem(LitMesh lit, Collapse how, double weight)
      : lit_(std::move(lit)), points_(find_surface_points(lit_)), mesh_(lit_, points_), how_(how) {
    const std::vector<Vec3d> colour = mean_colours(lit_);
    for (std::size_t v = 0; v < colour.size(); ++v) {
      const Vec3d p = to_double(lit_.mesh.position[v]), c = colour[v] * weight;
      place_.push_back((Vec6() << p.x, p.y, p.z, c.x, c.y, c.z).finished());
    }
    quadric_.resize(place_.size()), age_.assign(place_.size(), 0);
    for (const Triangle& t : lit_.mesh.triangles) {
      Quadric6 q;
      q.add_triangle(place_[t[0]], place_[t[1]], place_[t[2]], triangle_area(lit_.mesh, t));
      for (const std::uint32_t v : t) quadric_[v] += q;
    }
  }

  LitMesh run(std::size_t triangles) {
    for (std::uint32_t v = 0; v < place_.size(); ++v)
      if (mesh_.point(v) != SurfacePoints::kNone) push_around(v, true);
    while (mesh_.triangles_left() > triangles && !queue_.empty()) {
      const Candidate c = queue_.pop();
      if (age_[c.a] + age_[c.b] != c.age) continue;
      const Plan plan = plan_of(c.a, c.b);
      const EdgeSides sides = mesh_.sides(point(plan.gone), point(plan.kept));
      if (!mesh_.keeps_topology(point(plan.gone), point(plan.kept), sides)) continue;
      const Vec3d at{plan.best[0], plan.best[1], plan.best[2]};
      if (mesh_.spoils(point(plan.gone), point(plan.kept), at)) continue;
      if (plan.moves && mesh_.spoils(point(plan.kept), point(plan.gone), at)) continue;
      join(plan, sides, at);
    }
    std::vector<Triangle> left;
    for (std::uint32_t t = 0; t < lit_.mesh.triangles.size(); ++t)
      if (!mesh_.gone(t)) left.push_back(lit_.mesh.triangles[t]);
    lit_.mesh.triangles = left;
    lit_.mesh.part.assign(left.size(), 0);
    drop_unused_vertices(lit_);
    return std::move(lit_);
  }

 private:
  struct Plan {
    double cost = HUGE_VAL;
    std::uint32_t gone = 0, kept = 0;
    Vec6 best = Vec6::Zero();
    bool moves = false;
  };
  std::uint32_t point(std::uint32_t v) const { return mesh_.point(v); }

  Plan plan_of(std::uint32_t v, std::uint32_t w) const {
    Plan best;
    Quadric6 q = quadric_[v];
    q += quadric_[w];
    const auto consider = [&](std::uint32_t gone, std::uint32_t kept, const Vec6& at, bool moves) {
      const double cost = std::max(0.0, q.at(at));
      if (cost < best.cost) best = {cost, gone, kept, at, moves};
    };
    for (const auto& [gone, kept] : {std::pair(v, w), std::pair(w, v)}) {
      const auto allowed = mesh_.allowed(point(gone), point(kept), mesh_.sides(point(gone), point(kept)));
      if (allowed.at_kept) consider(gone, kept, place_[kept], false);
      if (!allowed.elsewhere || how_ == Collapse::half_edge) continue;
      const auto factor = q.a.ldlt();
      const Vec6 least = factor.solve(-q.b), middle = (place_[v] + place_[w]) * 0.5;
      const bool near = (least - middle).head<3>().norm() <= 2 * (place_[v] - place_[w]).head<3>().norm();
      if (factor.rcond() > 1e-9 && near) consider(gone, kept, least, true);
    }
    return best;
  }

  void push_around(std::uint32_t v, bool upwards) {
    const std::vector<std::uint32_t> ring = mesh_.ring(point(v));
    for (const std::uint32_t p : ring) {
      std::uint32_t w = 0;
      mesh_.each_vertex(p, [&](std::uint32_t x) { w = x; });
      if (upwards && w < v) continue;
      const double cost = plan_of(std::min(v, w), std::max(v, w)).cost;
      if (std::isfinite(cost))
        queue_.push({static_cast<float>(cost), std::min(v, w), std::max(v, w), age_[v] + age_[w]});
    }
  }

  void join(const Plan& plan, const EdgeSides& sides, const Vec3d& at) {
    if (plan.moves) {
      const Vec3d from = mesh_.position(point(plan.gone)), edge = mesh_.position(point(plan.kept)) - from;
      const double share = dot(edge, edge) > 0 ? std::clamp(dot(at - from, edge) / dot(edge, edge), 0.0, 1.0) : 1;
      draw_towards(lit_, plan.kept, plan.gone, static_cast<float>(share));
      lit_.mesh.position[plan.kept] = to_float(at);
      place_[plan.kept] = plan.best;
    }
    quadric_[plan.kept] += quadric_[plan.gone];
    mesh_.join(point(plan.gone), point(plan.kept), sides);
    ++age_[plan.gone], ++age_[plan.kept];
    push_around(plan.kept, false);
  }

  LitMesh lit_;
  SurfacePoints points_;
  CollapseMesh mesh_;
  Collapse how_;
  std::vector<Vec6> place_;
  std::vector<Quadric6> quadric_;
  std::vector<std::uint32_t> age_;
  CollapseQueue queue_;
};

}  // namespace

LitMesh simplify_colour_qem(const LitMesh& lit, std::size_t triangles, Collapse how, double weight) {
  return ColourQem(lit, how, weight).run(triangles);
}

}  // namespace kiln::bench
