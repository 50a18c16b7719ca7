#include "core/meshless/radiosity.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "core/base/expects.h"
#include "core/base/random.h"
#include "core/meshless/basis.h"
#include "core/meshless/gather_rows.h"
#include "core/prt/morton.h"
#include "core/prt/ray_origin.h"

namespace kiln {
namespace {

constexpr std::size_t kBlock = 128;
constexpr DirectRays kOnPaths{.lamps = {.few = 2, .many = 2}, .sky = kPacket};  // one of hundreds of rays passes there
constexpr float kChildReach = 2;  // of the parent level's R: points that a flagged point sends for

double mean_of(const Vec3f& x) { return (double{x.x} + double{x.y} + double{x.z}) / 3; }
float largest(const Vec3f& x) { return std::max({std::abs(x.x), std::abs(x.y), std::abs(x.z)}); }

/// Interpolation weights of many places: rows of a sparse matrix.
class Stencils {
 public:
  Stencils(const MeshlessBasis& basis, std::span<const SurfaceSite> places, Threads& threads)
      : cover_(places.size()), begin_(places.size() + 1) {
    std::vector<std::vector<BasisTerm>> found((places.size() + kBlock - 1) / kBlock);
    threads.for_blocks(places.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      std::vector<BasisTerm>& own = found[begin / kBlock];
      for (std::size_t i = begin; i < end; ++i) {
        cover_[i] = basis.terms(places[i], basis.levels(), own);
        begin_[i + 1] = own.size();
      }
    });
    std::size_t total = 0;
    for (std::size_t block = 0; block < found.size(); ++block) {
      const std::size_t end = std::min(places.size(), (block + 1) * kBlock);
      for (std::size_t i = block * kBlock; i < end; ++i) begin_[i + 1] += total;
      total += found[block].size();
    }
    terms_.reserve(total);
    for (const auto& own : found) terms_.insert(terms_.end(), own.begin(), own.end());
  }
  Cover cover(std::size_t i) const { return cover_[i]; }
  template <class F>
  void each(std::size_t i, const F& f) const {
    for (std::size_t k = begin_[i]; k < begin_[i + 1]; ++k) f(terms_[k]);
  }
  Vec3f apply(std::size_t i, std::span<const Vec3f> values) const {
    Vec3f sum;
    each(i, [&](const BasisTerm& t) { sum += values[t.function] * t.value; });
    return sum;
  }

 private:
  std::vector<Cover> cover_;
  std::vector<std::size_t> begin_;
  std::vector<BasisTerm> terms_;
};

class Solver {
 public:
  Solver(const Tracer& tracer, const Environment* sky, const Radiosity& params, Threads& threads)
      : tracer_(tracer),
        params_(params),
        threads_(threads),
        faces_(tracer.scene()),
        albedo_(tracer.scene()),
        light_(tracer, sky, params.direct),
        rough_light_(tracer, sky, params.direct.rough()),
        path_light_(tracer, sky, kOnPaths),
        vertices_(vertex_points(tracer.scene().mesh)) {
    for (const StandIn& s : params.stand_ins) vertices_[s.vertex] = s.point;
    begin_stage("points");
    points_ = place_points(tracer, faces_, params.points, threads);
    for (const MeshlessPoint& p : points_.points) {
      sites_.push_back(p.site);
      at_.push_back(transfer_point(p));
    }
    senders_.emplace(tracer.scene(), points_, params.points.groups_by_part, threads);
    rows_.emplace(GatherRows::World{tracer_, faces_, albedo_, *senders_, path_light_}, params.rays, params.seed);
  }

  RadiosityResult solve() {
    begin_stage("direct");
    out_.direct = params_.known_direct.empty() ? direct_at(vertices_, light_) : params_.known_direct;
    out_.indirect.resize(vertices_.size());
    for (std::size_t level = 0; level < points_.levels(); ++level) {
      out_.stats.points.push_back(points_.level_end[level] - points_.begin(level));
    }
    if (params_.bounces == 0) return std::move(out_);
    direct_ = direct_at(at_, rough_light_);
    begin_stage("gather");
    gather_adaptively();
    begin_stage("basis");
    prepare_reading();
    begin_stage("sweeps");
    iterate();
    return std::move(out_);
  }

 private:
  void begin_stage(std::string_view name) const {
    if (params_.stage) params_.stage(name);
  }

  std::vector<Vec3f> direct_at(const std::vector<TransferPoint>& places, const DirectLight& light) {
    std::vector<Vec3f> out(places.size());
    if (light.none()) return out;
    std::atomic<std::uint64_t> rays = 0;
    const std::vector<std::uint32_t> order = morton_order_of(places);
    threads_.for_blocks(places.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      std::uint64_t own = 0;
      for (std::size_t i = begin; i < end; ++i) {
        const TransferPoint& p = places[order[i]];
        const std::uint64_t seed = mix64(params_.seed ^ point_key(p));
        out[order[i]] = light.at({ray_origin(p), p.normal}, seed, own);
      }
      rays += own;
    });
    out_.stats.direct_rays += rays;
    return out;
  }

  /// Gathers at points and keeps what one bounce brings there.
  void gather(std::vector<std::uint32_t> points) {
    std::vector<TransferPoint> places;
    std::vector<Vec3f> positions;
    for (const std::uint32_t p : points) positions.push_back(sites_[p].position);
    const std::size_t first = receiver_.size();
    for (const std::uint32_t i : morton_order(positions)) {
      receiver_.push_back(points[i]);
      places.push_back(at_[points[i]]);
    }
    rows_->add(places, false, threads_, out_.stats.gather_rays);
    first_bounce_.resize(receiver_.size());
    threads_.for_blocks(places.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t r = first + begin; r < first + end; ++r) first_bounce_[r] = rows_->apply(r, direct_);
    });
    out_.stats.gathered.push_back(static_cast<std::uint32_t>(points.size()));
  }

  MeshlessBasis flattened(std::size_t receivers) const {
    std::vector<SurfaceSite> some;
    for (std::size_t r = 0; r < receivers; ++r) some.push_back(sites_[receiver_[r]]);
    const std::uint32_t end[] = {static_cast<std::uint32_t>(receivers)};
    return {some, end, threads_, params_.neighbours};
  }

  /// COMPUTE-BOUNCE's refinement, for all bounces at once.
  void gather_adaptively() {
    std::size_t before = 0;  // receivers of the levels above the last one
    for (std::size_t level = 0; level < points_.levels(); ++level) {
      std::vector<std::uint32_t> chosen;
      if (level < static_cast<std::size_t>(params_.uniform_levels)) {
        for (std::uint32_t p = points_.begin(level); p < points_.level_end[level]; ++p) chosen.push_back(p);
      } else {
        chosen = children_of(mispredicted(before), level);
      }
      before = receiver_.size();
      gather(std::move(chosen));
    }
  }

  /// RECEIVER-ORACLE: points gathered last that those before them do not predict.
  std::vector<std::uint32_t> mispredicted(std::size_t before) const {
    double mean = 0;
    for (std::size_t r = 0; r < receiver_.size(); ++r) mean += mean_of(first_bounce_[r] + direct_[receiver_[r]]);
    const auto limit =
        static_cast<float>(params_.eps * mean / static_cast<double>(std::max<std::size_t>(1, receiver_.size())));
    const MeshlessBasis coarser = flattened(before);
    const std::span<const Vec3f> known(first_bounce_.data(), before);
    std::vector<char> wrong(receiver_.size() - before);
    threads_.for_blocks(wrong.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::size_t r = before + i;
        const Vec3f predicted = coarser.evaluate(known, sites_[receiver_[r]], 1);
        wrong[i] = largest(first_bounce_[r] - predicted) > limit ? 1 : 0;
      }
    });
    std::vector<std::uint32_t> out;
    for (std::size_t i = 0; i < wrong.size(); ++i) {
      if (wrong[i] != 0) out.push_back(receiver_[before + i]);
    }
    return out;
  }

  /// The points of a level around points of the level above.
  std::vector<std::uint32_t> children_of(const std::vector<std::uint32_t>& parents, std::size_t level) const {
    const float reach = kChildReach * points_.radius[level - 1];
    PointGrid grid(2 * reach);
    for (const std::uint32_t p : parents) grid.add(p, sites_[p].position);
    std::vector<std::uint32_t> out;
    for (std::uint32_t p = points_.begin(level); p < points_.level_end[level]; ++p) {
      bool near = false;
      grid.near(sites_[p].position, reach, [&](std::uint32_t q, float d2) {
        const float cosine = dot(sites_[p].normal, sites_[q].normal);
        near = near || (sites_[p].group == sites_[q].group && cosine > 0 && d2 <= reach * reach * cosine * cosine);
      });
      if (near) out.push_back(p);
    }
    return out;
  }

  /// How senders and vertices get reflected light from the receivers, and rows for vertices that cannot.
  void prepare_reading() {
    const MeshlessBasis basis = flattened(receiver_.size());
    at_senders_.emplace(basis, sites_, threads_);
    std::vector<SurfaceSite> places;
    const std::vector<std::uint32_t> part = parts_of_vertices();
    for (std::size_t v = 0; v < vertices_.size(); ++v) {
      const TransferPoint& p = vertices_[v];
      places.push_back({p.position, p.normal, params_.points.groups_by_part ? part[v] : 0});
    }
    at_vertices_.emplace(basis, places, threads_);
    enum Reading : char { interpolated, own_row, enclosed };
    std::vector<char> reading(vertices_.size());
    for_each(vertices_.size(), [&](std::size_t v) {
      reading[v] = is_enclosed(tracer_, faces_, vertices_[v])   ? enclosed
                   : at_vertices_->cover(v) != Cover::functions ? own_row
                                                                : interpolated;
    });
    for (const Reading kind : {own_row, enclosed}) {
      std::vector<TransferPoint> own;
      for (std::uint32_t v = 0; v < reading.size(); ++v) {
        if (reading[v] != kind) continue;
        alone_.push_back(v);
        own.push_back(vertices_[v]);
      }
      rows_->add(own, kind == enclosed, threads_, out_.stats.gather_rays);
    }
    out_.stats.alone = alone_.size();
  }

  std::vector<std::uint32_t> parts_of_vertices() const {
    const Mesh& mesh = tracer_.scene().mesh;
    std::vector<std::uint32_t> part(mesh.position.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      for (const std::uint32_t v : mesh.triangles[t]) part[v] = mesh.part[t];
    }
    return part;
  }

  /// The Neumann series i_{k+1} = c + T (e + i_k), and the reading of its limit at vertices.
  void iterate() {
    std::vector<Vec3f> gathered(receiver_.size()), next(receiver_.size()), total = direct_;
    double before = 0, ratio_before = 0;
    const bool automatic = params_.bounces < 0;
    const int most = automatic ? kMostSweeps : params_.bounces;
    for (int sweep = 0; sweep < most; ++sweep) {
      if (sweep > 0) spread(gathered, total);
      for_each(next.size(), [&](std::size_t r) { next[r] = rows_->apply(r, total); });
      double change = 0, light = 0;
      for (std::size_t r = 0; r < next.size(); ++r) {
        change += mean_of(next[r] - gathered[r]);
        light += mean_of(next[r]) + mean_of(direct_[receiver_[r]]);
      }
      const double ratio = before > 0 ? change / before : 0;
      if (params_.bounces < 0 && ratio > 0 && ratio < 1 && std::abs(ratio - ratio_before) < 0.02 * (1 - ratio)) {
        // A steady factor: what is to come is a geometric series.
        const auto rest = static_cast<float>(ratio / (1 - ratio));
        for (std::size_t r = 0; r < next.size(); ++r) next[r] += (next[r] - gathered[r]) * rest;
        before = ratio_before = 0;
      } else {
        before = change, ratio_before = ratio;
      }
      std::swap(gathered, next);
      out_.stats.sweeps = sweep + 1;
      if (params_.bounces < 0 && std::abs(change) <= kTail * light * (1 - std::min(ratio, 0.9999))) break;
    }
    if (automatic) spread(gathered, total);
    if (params_.vector) {
      std::vector<VectorValue> turned(receiver_.size());
      for_each(turned.size(), [&](std::size_t r) { turned[r] = rows_->apply_vector(r, at_[receiver_[r]], total); });
      // The sweeps' own value, to which the rest of the series may have been added.
      for_each(turned.size(), [&](std::size_t r) { turned[r].value = gathered[r]; });
      for_each(vertices_.size(), [&](std::size_t v) {
        at_vertices_->each(
            v, [&](const BasisTerm& t) { out_.indirect[v] += turned[t.function].at(vertices_[v].normal) * t.value; });
      });
    } else {
      for_each(vertices_.size(), [&](std::size_t v) { out_.indirect[v] = at_vertices_->apply(v, gathered); });
    }
    for_each(alone_.size(),
             [&](std::size_t i) { out_.indirect[alone_[i]] = rows_->apply(receiver_.size() + i, total); });
  }

  /// Direct and reflected light at all senders.
  void spread(const std::vector<Vec3f>& gathered, std::vector<Vec3f>& total) {
    for_each(total.size(), [&](std::size_t s) { total[s] = direct_[s] + at_senders_->apply(s, gathered); });
    for_each(receiver_.size(), [&](std::size_t r) { total[receiver_[r]] = direct_[receiver_[r]] + gathered[r]; });
  }

  template <class F>
  void for_each(std::size_t count, const F& f) {
    threads_.for_blocks(count, kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) f(i);
    });
  }

  const Tracer& tracer_;
  const Radiosity& params_;
  Threads& threads_;
  GatherFaces faces_;
  HitAlbedo albedo_;
  DirectLight light_, rough_light_, path_light_;  // at vertices, at points, on the way of a ray
  std::vector<TransferPoint> vertices_;
  PointHierarchy points_;
  std::vector<SurfaceSite> sites_;  // of the points
  std::vector<TransferPoint> at_;
  std::optional<Senders> senders_;
  std::optional<GatherRows> rows_;       // of the receivers, then of `alone_`
  std::vector<Vec3f> direct_;            // at the points
  std::vector<std::uint32_t> receiver_;  // the point of each row
  std::vector<Vec3f> first_bounce_;      // at the receivers
  std::optional<Stencils> at_senders_, at_vertices_;
  std::vector<std::uint32_t> alone_;  // vertices
  RadiosityResult out_;
};

}  // namespace

RadiosityResult solve_radiosity(const Tracer& tracer, const Environment* sky, const Radiosity& params,
                                Threads& threads) {
  EXPECTS(params.known_direct.empty() || params.known_direct.size() == tracer.scene().mesh.position.size());
  EXPECTS(params.rays >= 1 && params.rays <= 65536 && params.neighbours >= 1 && params.uniform_levels >= 1);
  return Solver(tracer, sky, params, threads).solve();
}

}  // namespace kiln
