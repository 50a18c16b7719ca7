#include "core/meshless/paper_bounces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "core/base/expects.h"
#include "core/base/random.h"
#include "core/meshless/cover.h"
#include "core/meshless/radiosity.h"
#include "core/prt/direction_sets.h"
#include "core/prt/ray_origin.h"

namespace kiln {
namespace {

constexpr std::size_t kBlock = 16;
constexpr int kSets = 8;
constexpr double kSlowest = 0.9999;  // ratio of a series, at most: more is noise

double mean_of(const Vec3f& x) { return (double{x.x} + double{x.y} + double{x.z}) / 3; }
float largest(const Vec3f& x) { return std::max({std::abs(x.x), std::abs(x.y), std::abs(x.z)}); }

/// Of a ball as seen from a distance.
float solid_angle(float radius, float distance2) {
  const float inside = 1 - radius * radius / std::max(distance2, 1e-30F);
  return inside <= 0 ? 4 * std::numbers::pi_v<float> : 2 * std::numbers::pi_v<float> * (1 - std::sqrt(inside));
}

class Series {
 public:
  Series(const PaperWorld& world, const MeshlessBasis& basis, std::span<const TransferPoint> points,
         const PaperBounces& params, Threads& threads)
      : world_(world),
        basis_(basis),
        points_(points),
        params_(params),
        threads_(threads),
        sets_(0, params.rays, kSets, mix64(params.seed)) {}

  PaperLight sum(std::span<const Vec3f> direct) {
    out_.coefficients.resize(points_.size());
    out_.gathered.resize(points_.size());
    if (points_.empty()) return std::move(out_);
    sent_ = basis_.coefficients(direct, threads_);  // e
    deepest_ = basis_.levels();
    roots_ = find_roots();
    double light = mean_light(sent_), before = light, ratio = 0;
    light_ = light;
    const bool automatic = params_.bounces < 0;
    const int most = automatic ? kMostPaperBounces : params_.bounces;
    for (int bounce = 0; bounce < most; ++bounce) {
      compute_bounce();
      for (std::size_t p = 0; p < points_.size(); ++p) out_.coefficients[p] += sent_[p];
      const double now = mean_light(sent_);
      light += now;
      ratio = before > 0 ? std::min(kSlowest, now / before) : 0;
      before = now;
      out_.bounces = bounce + 1;
      out_.tail = light > 0 ? now * ratio / (1 - ratio) / light : 0;
      if (automatic && out_.tail < kTail) break;
    }
    if (automatic) {
      const auto rest = static_cast<float>(ratio / (1 - ratio));
      for (std::size_t p = 0; p < points_.size(); ++p) out_.coefficients[p] += sent_[p] * rest;
    }
    return std::move(out_);
  }

 private:
  using Points = std::vector<std::uint32_t>;

  /// Mean over the points of what the coefficients say there.
  double mean_light(std::span<const Vec3f> coefficients) const {
    std::vector<double> light(points_.size());
    threads_.for_blocks(light.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t p = begin; p < end; ++p) {
        const SurfaceSite& site = basis_.site(static_cast<std::uint32_t>(p));
        light[p] = std::max(0.0, mean_of(basis_.evaluate(coefficients, site, basis_.levels())));
      }
    });
    return std::accumulate(light.begin(), light.end(), 0.0) / static_cast<double>(light.size());
  }

  /// Points with no function of a coarser level around them: all of the coarsest, and the coarsest of each group.
  Points find_roots() const {
    Points out;
    std::vector<BasisTerm> terms;
    for (std::uint32_t p = 0; p < points_.size(); ++p) {
      terms.clear();
      if (basis_.terms(basis_.site(p), basis_.level_of(p), terms) != Cover::functions) out.push_back(p);
    }
    return out;
  }

  /// From i_k in sent_ to i_{k+1}.
  void compute_bounce() {
    value_.assign(points_.size(), {});
    next_.assign(points_.size(), {});
    known_.assign(points_.size(), 0);
    Points fresh;
    for (const std::uint32_t p : roots_) take(p, fresh);
    fresh = with_parents(std::move(fresh));
    gather(fresh);
    if (out_.bounces == 0) light_ += mean_light(next_);
    std::size_t deepest = basis_.level_of(fresh.back()) + 1;
    while (!(fresh = with_parents(children_of(asking(fresh)))).empty()) {
      gather(fresh);
      deepest = std::max(deepest, basis_.level_of(fresh.back()) + 1);
    }
    sent_ = next_;
    deepest_ = deepest;
  }

  /// GATHER at points, ascending, and their coefficients.
  void gather(const Points& points) {
    std::vector<std::uint64_t> rays((points.size() + kBlock - 1) / kBlock);
    threads_.for_blocks(points.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        value_[points[i]] = gathered_at(points_[points[i]], rays[begin / kBlock]);
    });
    for (const std::uint64_t n : rays) out_.rays += n;
    for (const std::uint32_t p : points) out_.gathered[p] = 1;
    difference(points);
  }

  Vec3f gathered_at(const TransferPoint& point, std::uint64_t& sent) const {
    const LocalFrame frame = local_frame(sets_, point.normal, params_.seed, point_key(point));
    const Vec3f origin = ray_origin(point);
    Random random(params_.seed, point_key(point), 1);
    Rays16 rays;
    Hits16 hits;
    rays.ox.fill(origin.x), rays.oy.fill(origin.y), rays.oz.fill(origin.z), rays.far.fill(kFar);
    std::vector<BasisTerm> terms;
    Vec3f sum;
    for (int packet = 0; packet < sets_.samples() / kPacket; ++packet) {
      sets_.turn(frame.set, packet, frame.basis, rays);
      world_.tracer.closest16(rays, hits);
      sent += kPacket;
      for (std::size_t i = 0; i < kPacket; ++i) {
        if (hits.triangle[i] == kNoHit) continue;
        const Vec3f w{rays.dx[i], rays.dy[i], rays.dz[i]};
        const HitSide side = world_.faces.side(hits.triangle[i], w);
        if (side == HitSide::dark) continue;
        MeshlessPoint at =
            point_on(world_.tracer.scene(), hits.triangle[i], {hits.u[i], hits.v[i]}, side == HitSide::flipped);
        at.site.group = group_of(world_.tracer, transfer_point(at), world_.cover);
        const auto draw = static_cast<std::uint32_t>(random.next());
        const Vec3f albedo = albedo_at(hits.triangle[i], hits.u[i], hits.v[i], draw);
        sum += albedo * light_at(at.site, origin, terms);
      }
    }
    return sum / static_cast<float>(sets_.samples());
  }

  Vec3f albedo_at(std::uint32_t triangle, float u, float v, std::uint32_t draw) const {
    if (world_.faces.is_plain(triangle)) return world_.faces.plain(world_.tracer.scene().mesh.part[triangle]);
    return world_.albedo.read(world_.albedo.tap(triangle, u, v, draw));
  }

  /// i_k at a place, down to the level that is fine enough from `eye`.
  Vec3f light_at(const SurfaceSite& site, const Vec3f& eye, std::vector<BasisTerm>& terms) const {
    Vec3f sum;
    bool found = false;
    for (std::size_t level = 0; level < deepest_; ++level) {
      terms.clear();
      if (!basis_.terms_of(level, site, terms)) {
        if (found) continue;
        const std::uint32_t nearest = basis_.nearest(site, level);
        found = nearest != MeshlessBasis::kNoFunction;
        if (found) sum = sent_[nearest];
        continue;
      }
      found = true;
      float angles = 0;
      for (const BasisTerm& t : terms) {
        sum += sent_[t.function] * t.value;
        const Vec3f way = basis_.site(t.function).position - eye;
        angles += solid_angle(basis_.radius(t.function), dot(way, way));
      }
      if (angles < params_.eps_solid_angle * static_cast<float>(terms.size())) break;
    }
    return sum;
  }

  /// Equation 10, coarse to fine: what is gathered less what coarser functions say.
  void difference(const Points& points) {
    for (std::size_t first = 0, end = 0; first < points.size(); first = end) {
      const std::size_t level = basis_.level_of(points[first]);
      while (end < points.size() && points[end] < basis_.level_end(level)) ++end;
      threads_.for_blocks(end - first, kBlock, [&](std::size_t a, std::size_t b) {
        for (std::size_t i = first + a; i < first + b; ++i) {
          const std::uint32_t p = points[i];
          next_[p] = level == 0 ? value_[p] : value_[p] - basis_.evaluate(next_, basis_.site(p), level);
        }
      });
    }
  }

  /// RECEIVER-ORACLE: those of the points that ask for children.
  Points asking(const Points& points) const {
    const auto limit = static_cast<float>(params_.eps * light_);
    std::vector<char> asks(points.size());
    threads_.for_blocks(points.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      std::vector<BasisTerm> around;
      for (std::size_t i = begin; i < end; ++i) {
        const std::uint32_t p = points[i];
        if (basis_.level_of(p) > 0) {
          asks[i] = largest(next_[p]) > limit ? 1 : 0;
          continue;
        }
        around.clear();
        basis_.terms_of(0, basis_.site(p), around);
        for (const BasisTerm& t : around) {
          if (largest(value_[p] - value_[t.function]) > limit) asks[i] = 1;
        }
      }
    });
    Points out;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (asks[i] != 0) out.push_back(points[i]);
    }
    return out;
  }

  /// Points of the next level each, whose functions are not 0 there; not known yet.
  Points children_of(const Points& parents) {
    Points out;
    std::vector<BasisTerm> terms;
    for (const std::uint32_t p : parents) {
      const std::size_t level = basis_.level_of(p) + 1;
      if (level == basis_.levels()) continue;
      terms.clear();
      basis_.terms_of(level, basis_.site(p), terms);
      for (const BasisTerm& t : terms) take(t.function, out);
    }
    return out;
  }

  /// With all points that they are differences from, and those of these: ascending.
  Points with_parents(Points points) {
    std::vector<BasisTerm> terms;
    for (std::size_t i = 0; i < points.size(); ++i) {
      terms.clear();
      basis_.terms(basis_.site(points[i]), basis_.level_of(points[i]), terms);
      for (const BasisTerm& t : terms) take(t.function, points);
    }
    std::ranges::sort(points);
    return points;
  }

  /// Once in a bounce.
  void take(std::uint32_t p, Points& to) {
    if (known_[p] == 0) to.push_back(p);
    known_[p] = 1;
  }

  const PaperWorld& world_;
  const MeshlessBasis& basis_;
  std::span<const TransferPoint> points_;
  const PaperBounces& params_;
  Threads& threads_;
  const DirectionSets sets_;
  Points roots_;
  std::vector<Vec3f> sent_;          // i_k
  std::size_t deepest_ = 0;          // levels of it that are not all 0
  std::vector<Vec3f> value_, next_;  // what was gathered, i_{k+1}
  std::vector<char> known_;          // of each point: whether i_{k+1} has it
  double light_ = 0;                 // mean, with the first reflection
  PaperLight out_;
};

}  // namespace

PaperLight bounce_on_basis(const PaperWorld& world, const MeshlessBasis& basis, std::span<const TransferPoint> points,
                           std::span<const Vec3f> direct, const PaperBounces& params, Threads& threads) {
  EXPECTS(points.size() == basis.functions() && direct.size() == points.size());
  EXPECTS(params.rays >= 1 && params.rays <= 65536);
  return Series(world, basis, points, params, threads).sum(direct);
}

}  // namespace kiln
