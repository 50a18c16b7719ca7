#include "core/lightfield/simplify.h"

#include <algorithm>
#include <cmath>

#include "core/base/expects.h"
#include "core/lightfield/collapse_reach.h"
#include "core/mesh/collapse_queue.h"

namespace kiln {
namespace {

/// A cost counts the change at one point for all of the triangles around it. There it falls to nothing at their other
/// corners: the mean square of such a hat over a triangle is a sixth of its height's.
double relative_error(double summed_cost) { return std::sqrt(summed_cost / 6); }

class Simplifier {
 public:
  Simplifier(LitMesh lit, const Simplify& params, Threads& threads)
      : params_(params),
        threads_(threads),
        lit_(std::move(lit)),
        points_(find_surface_points(lit_)),
        mesh_(lit_, points_),
        cost_(mesh_, params.geometry_weight, params.collapse, params.mean_square),
        reach_(mesh_, params.max_reach),
        age_(mesh_.points(), 0) {
    if (params.record) out_.record.before.field = empty_like(lit_.field);
  }

  SimplifyResult run() {
    prepare();
    for (std::size_t step = 0; mesh_.triangles_left() > params_.triangles && !queue_.empty(); ++step) {
      if (step % 1024 == 0) report();
      const Candidate c = queue_.pop();
      if (age_[c.a] + age_[c.b] != c.age) continue;
      const CollapsePlan plan = cost_.plan(c.a, c.b);
      if (!may_join(plan)) continue;  // it comes again when something around it changes
      if (relative_error(summed_cost_ + plan.cost) > params_.max_error) break;
      join(plan);
      if (queue_.size() > 3 * mesh_.triangles_left() + 1024) drop_stale();  // half of it is alive
    }
    return finish();
  }

 private:
  void report() const {
    threads_.check();
    const std::uint64_t all = lit_.mesh.triangles.size();
    if (params_.progress) params_.progress(all - mesh_.triangles_left(), all - params_.triangles);
  }

  void prepare() {
    constexpr std::size_t kBlock = 1024;
    threads_.for_blocks(lit_.mesh.position.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t v = begin; v < end; ++v) cost_.update_vertex(static_cast<std::uint32_t>(v));
    });
    threads_.for_blocks(mesh_.points(), kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t p = begin; p < end; ++p) cost_.update_point(static_cast<std::uint32_t>(p));
    });
    std::vector<Candidate> first;
    for (std::uint32_t p = 0; p < mesh_.points(); ++p) {
      if (mesh_.crowded(p)) continue;
      for (const std::uint32_t q : mesh_.ring(p))
        if (p < q) first.push_back({.a = p, .b = q});
    }
    threads_.for_blocks(first.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) first[i] = candidate(first[i].a, first[i].b);
    });
    std::erase_if(first, [](const Candidate& c) { return !std::isfinite(c.cost); });
    queue_.fill(std::move(first));
  }

  /// Of infinite cost where kinds forbid it.
  Candidate candidate(std::uint32_t p, std::uint32_t q) const {
    const auto [a, b] = std::minmax(p, q);
    const CollapsePlan plan = cost_.plan(a, b);
    const auto order = static_cast<float>(plan.order);
    return {plan.possible ? order : std::numeric_limits<float>::infinity(), a, b, age_[a] + age_[b]};
  }
  void push(std::uint32_t p, std::uint32_t q) {
    const Candidate c = candidate(p, q);
    if (std::isfinite(c.cost)) queue_.push(c);
  }
  void drop_stale() {
    queue_.keep([&](const Candidate& c) { return age_[c.a] + age_[c.b] == c.age; });
  }

  bool may_join(const CollapsePlan& plan) {
    if (!plan.possible || !mesh_.keeps_topology(plan.gone, plan.kept, plan.sides)) return false;
    const Vec3d place = to_double(plan.place);
    if (mesh_.spoils(plan.gone, plan.kept, place) || (plan.moves && mesh_.spoils(plan.kept, plan.gone, place)))
      return false;
    return reach_.allows(plan);
  }

  void join(const CollapsePlan& plan) {
    summed_cost_ += plan.cost;
    reach_.take(plan);
    moving_.clear();
    mesh_.each_vertex(plan.gone, [&](std::uint32_t v) {
      if (!plan.sides.goes(v)) moving_.push_back(v);
    });
    mesh_.each_vertex(plan.kept, [&](std::uint32_t w) {
      if (plan.moves) moving_.push_back(w);
    });
    if (params_.record) note_before(plan);
    for (std::uint32_t i = 0; plan.moves && i < plan.sides.pairs; ++i)
      draw_towards(lit_, plan.sides.to[i], plan.sides.from[i], plan.share);
    for (const std::uint32_t v : moving_) lit_.mesh.position[v] = plan.place;
    const CollapseMesh::Joined& joined = mesh_.join(plan.gone, plan.kept, plan.sides);
    if (params_.record) note_after(plan, joined);
    renew(plan);
  }

  /// Costs of all that saw the change: edges with an end next to the new point.
  void renew(const CollapsePlan& plan) {
    changed_ = mesh_.ring(plan.kept);
    changed_.push_back(plan.kept);
    ++age_[plan.gone];
    for (const std::uint32_t p : changed_) {
      ++age_[p];
      cost_.update_point(p);
      mesh_.each_vertex(p, [&](std::uint32_t v) { cost_.update_vertex(v); });
    }
    for (const std::uint32_t p : changed_) {
      if (mesh_.crowded(p)) continue;
      for (const std::uint32_t q : mesh_.ring(p)) {
        const bool twice = std::ranges::find(changed_, q) != changed_.end();
        if (!twice || p < q) push(p, q);
      }
    }
  }

  void note_before(const CollapsePlan& plan) {
    CollapseRecord& r = out_.record;
    for (const std::uint32_t v : moving_) append_vertex(r.before, lit_, v);
    r.moved.insert(r.moved.end(), moving_.begin(), moving_.end());
    for (std::uint32_t i = 0; i < plan.sides.triangles; ++i) r.removed.push_back(plan.sides.triangle[i]);
  }
  void note_after(const CollapsePlan& plan, const CollapseMesh::Joined& joined) {
    CollapseRecord& r = out_.record;
    r.turned.insert(r.turned.end(), joined.turned.begin(), joined.turned.end());
    r.orphans.insert(r.orphans.end(), joined.orphans.begin(), joined.orphans.end());
    r.steps.push_back({.pairs = plan.sides.pairs,
                       .gone = plan.sides.from,
                       .kept = plan.sides.to,
                       .orphans = r.orphans.size(),
                       .moved = r.moved.size(),
                       .removed = r.removed.size(),
                       .turned = r.turned.size(),
                       .error = static_cast<float>(relative_error(summed_cost_))});
  }

  SimplifyResult finish() {
    out_.error = relative_error(summed_cost_);
    out_.reached = mesh_.triangles_left() <= params_.triangles;
    if (params_.record) out_.record.all = lit_;
    std::size_t kept = 0;
    Mesh& m = lit_.mesh;
    for (std::size_t t = 0; t < m.triangles.size(); ++t) {
      if (mesh_.gone(static_cast<std::uint32_t>(t))) continue;
      if (!m.part.empty()) m.part[kept] = m.part[t];
      m.triangles[kept++] = m.triangles[t];
    }
    m.triangles.resize(kept);
    if (!m.part.empty()) m.part.resize(kept);
    drop_unused_vertices(lit_);
    out_.lit = std::move(lit_);
    return std::move(out_);
  }

  const Simplify& params_;
  Threads& threads_;
  LitMesh lit_;
  SurfacePoints points_;
  CollapseMesh mesh_;
  CollapseCost cost_;
  CollapseReach reach_;
  std::vector<std::uint32_t> age_;  // of a point: how often its candidates were renewed
  CollapseQueue queue_;
  double summed_cost_ = 0;
  std::vector<std::uint32_t> changed_, moving_;  // points and vertices of the collapse at hand
  SimplifyResult out_;
};

}  // namespace

SimplifyResult simplify(LitMesh lit, const Simplify& params, Threads& threads) {
  EXPECTS(lit.field.vertices() == lit.mesh.position.size() && lit.mesh.normal.size() == lit.mesh.position.size());
  EXPECTS(params.geometry_weight >= 0 && params.geometry_weight <= 1);
  return Simplifier(std::move(lit), params, threads).run();
}

}  // namespace kiln
