#include "core/meshless/radiosity.h"

#include <algorithm>
#include <cmath>

#include "core/base/expects.h"
#include "core/base/random.h"
#include "core/meshless/adaptive_points.h"
#include "core/meshless/anderson.h"
#include "core/meshless/cover.h"
#include "core/meshless/gather_rows.h"
#include "core/meshless/paper_bounces.h"
#include "core/meshless/surface_reading.h"
#include "core/prt/ray_origin.h"

namespace kiln {
namespace {

constexpr std::size_t kBlock = 128;
constexpr int kPlainSweeps = 4;     // from whose last two the factor is known by which light shrinks at a bounce
constexpr double kFaintest = 0.01;  // at most this much of kTail may change in a sweep: some light shrinks slower
constexpr double kRounding = 3e-7;  // of the light: sweeps change it no less
constexpr std::uint64_t kFirstDraw = 0x70726f626531, kSecondDraw = 0x70726f626532;  // of the probes

double mean_of(const Vec3f& x) { return (double{x.x} + double{x.y} + double{x.z}) / 3; }
float largest(const Vec3f& x) { return std::max({std::abs(x.x), std::abs(x.y), std::abs(x.z)}); }

class Solver {
 public:
  Solver(const Tracer& tracer, const Environment* sky, const Radiosity& params, Threads& threads)
      : tracer_(tracer),
        params_(params),
        threads_(threads),
        light_(tracer, sky, params.direct),
        rough_light_(tracer, sky, params.direct.rough()),
        vertices_(vertex_points(tracer.scene().mesh)) {
    for (const StandIn& s : params.stand_ins) vertices_[s.vertex] = s.point;
    vertices_.insert(vertices_.end(), params.places.begin(), params.places.end());
    begin_stage("points");
    PointPlacement placement = params.points;
    if (params.paper) placement.both_sides = kMaxPointLevels;  // a hit reads its own side, with no path to lead on
    out_.surface = std::make_unique<LitSurface>(tracer, sky, LitSurface::Points{placement, vertices_}, threads);
    for (const MeshlessPoint& p : points().points) {
      at_.push_back(transfer_point(p));
    }
    rows_.emplace(out_.surface->paths(), params.rays, params.seed);
  }

  RadiosityResult solve() {
    begin_stage("direct");
    find_direct();
    out_.indirect.resize(vertices_.size());
    out_.stats.points = level_sizes(points());
    out_.stats.gathered.resize(points().levels());
    if (params_.light_points) {
      out_.points = points();
      out_.point_light = direct_at(at_, light_);
    }
    if (params_.bounces == 0) {
      out_.surface.reset();
      return std::move(out_);
    }
    direct_ = direct_at(at_, rough_light_);
    if (params_.paper) {
      solve_as_the_paper();
      return std::move(out_);
    }
    begin_stage("gather");
    gather_adaptively();
    begin_stage("basis");
    prepare_reading();
    begin_stage("sweeps");
    iterate();
    return std::move(out_);
  }

 private:
  const PointHierarchy& points() const { return out_.surface->points(); }

  void begin_stage(std::string_view name) const {
    if (params_.stage) params_.stage(name);
  }

  void find_direct() {
    if (params_.known_direct.empty()) {
      out_.direct = direct_at(vertices_, light_);
      return;
    }
    out_.direct = params_.known_direct;
    const std::vector<Vec3f> more = direct_at(params_.places, light_);
    out_.direct.insert(out_.direct.end(), more.begin(), more.end());
  }

  std::vector<Vec3f> direct_at(const std::vector<TransferPoint>& places, const DirectLight& light) {
    return light_at(places, light, params_.seed, out_.stats.direct_rays, threads_);
  }

  /// Gathers at points and keeps what one bounce brings there.
  void gather(std::span<const std::uint32_t> points) {
    const std::size_t first = receiver_.size();
    receiver_.insert(receiver_.end(), points.begin(), points.end());
    std::vector<TransferPoint> places;
    for (const std::uint32_t p : points) places.push_back(at_[p]);
    rows_->add(places, threads_, out_.stats.gather_rays);
    first_bounce_.resize(receiver_.size());
    threads_.for_blocks(places.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t r = first + begin; r < first + end; ++r) first_bounce_[r] = rows_->apply(r, direct_);
    });
    double mean = 0;
    for (std::size_t r = 0; r < receiver_.size(); ++r) mean += mean_of(first_bounce_[r] + direct_[receiver_[r]]);
    limit_ = static_cast<float>(params_.eps * mean / static_cast<double>(std::max<std::size_t>(1, receiver_.size())));
  }

  /// COMPUTE-BOUNCE's refinement, for all bounces at once.
  void gather_adaptively() {
    compute_adaptively({.tracer = tracer_,
                        .points = points(),
                        .uniform_levels = params_.uniform_levels,
                        .neighbours = params_.neighbours,
                        .compute = [this](std::span<const std::uint32_t> some) { gather(some); },
                        .wrong =
                            [this](std::size_t r, std::span<const BasisTerm> terms) {
                              return largest(first_bounce_[r] - sum_of(terms, first_bounce_)) > limit_;
                            }},
                       threads_);
  }

  /// How points and vertices get reflected light from the receivers. Points that see none gather for themselves, and
  /// so do vertices that see no point at all.
  void prepare_reading() {
    const SurfaceReading::Surface surface{tracer_, points(), out_.surface->paths().world().senders, vertices_};
    reading_ = SurfaceReading::of_all(
        surface, receiver_, params_.neighbours, [this](std::span<const std::uint32_t> some) { gather(some); },
        threads_);
    std::vector<TransferPoint> own;
    for (const std::uint32_t v : reading_->alone()) own.push_back(vertices_[v]);
    first_alone_ = rows_->size();
    rows_->add(own, threads_, out_.stats.gather_rays);
    out_.stats.alone = own.size();
    out_.stats.gathered = count_by_level(points(), receiver_);
  }

  /// The Neumann series i_{k+1} = c + T (e + i_k), mixed after its first terms, and the reading of its limit.
  void iterate() {
    std::vector<Vec3f> gathered(receiver_.size()), next(receiver_.size()), total = direct_;
    AndersonMixing mixing;
    double before = 0, ratio = 0;
    const bool automatic = params_.bounces < 0;
    const int most = automatic ? kMostSweeps : params_.bounces;
    for (int sweep = 0; sweep < most; ++sweep) {
      if (sweep > 0) spread(gathered, total);
      for_each(next.size(), [&](std::size_t r) { next[r] = rows_->apply(r, total); });
      double change = 0, light = 0;
      for (std::size_t r = 0; r < next.size(); ++r) {
        const Vec3f d = next[r] - gathered[r];
        change += (std::abs(double{d.x}) + std::abs(double{d.y}) + std::abs(double{d.z})) / 3;
        light += mean_of(next[r]) + mean_of(direct_[receiver_[r]]);
      }
      out_.stats.sweeps = sweep + 1;
      const bool plain = !automatic || sweep < kPlainSweeps;
      if (!automatic) out_.stats.tail = beyond(change, before > 0 ? before : light - change, light);
      if (plain) ratio = before > 0 ? std::min(1.0, change / before) : 0;
      before = change;
      const bool done = automatic && change <= light * std::max(kRounding, kTail * std::min(1 - ratio, kFaintest));
      if (plain || done) {
        std::swap(gathered, next);
      } else {
        gathered = mixing.next(gathered, next);
        for (Vec3f& x : gathered) x = {std::max(0.0F, x.x), std::max(0.0F, x.y), std::max(0.0F, x.z)};
      }
      if (done) break;
    }
    if (automatic) spread(gathered, total);
    for_each(out_.point_light.size(),
             [&](std::size_t p) { out_.point_light[p] += sum_of(reading_->of_point(p), gathered); });
    read_vertices(gathered, total);
    probe(total, [this](std::uint32_t v) { return spread_of(v); });
    out_.surface->set_light(std::move(total), threads_);
  }

  /// The paper's scheme, on all points but those that were asked for.
  void solve_as_the_paper() {
    begin_stage("basis");
    const std::vector<std::uint32_t> ends(points().level_end.begin(),
                                          points().level_end.begin() + points().placed_levels());
    const std::size_t placed = ends.empty() ? 0 : ends.back();
    const auto site_of = [this](const TransferPoint& p) {
      return SurfaceSite{p.position, p.normal, group_of(tracer_, p, points().cover)};
    };
    std::vector<SurfaceSite> sites;
    for (std::size_t p = 0; p < placed; ++p) sites.push_back(points().points[p].site);
    const MeshlessBasis basis(sites, ends, threads_, params_.neighbours);
    begin_stage("bounces");
    const SenderPaths::World& world = out_.surface->paths().world();
    const PaperLight light =
        bounce_on_basis({tracer_, world.faces, world.albedo, points().cover}, basis, std::span(at_).first(placed),
                        std::span(direct_).first(placed),
                        {params_.rays, params_.eps, *params_.paper, params_.bounces, params_.seed}, threads_);
    out_.stats.gather_rays += light.rays;
    out_.stats.sweeps = light.bounces;
    out_.stats.tail = light.tail;
    for (std::uint32_t p = 0; p < placed; ++p) {
      if (light.gathered[p] != 0) receiver_.push_back(p);
    }
    out_.stats.gathered = count_by_level(points(), receiver_);
    begin_stage("reading");
    const auto reflected = [&](const TransferPoint& p) {
      const Vec3f x = basis.evaluate(light.coefficients, site_of(p), basis.levels());
      return Vec3f{std::max(0.0F, x.x), std::max(0.0F, x.y), std::max(0.0F, x.z)};
    };
    for_each(vertices_.size(), [&](std::size_t v) { out_.indirect[v] = reflected(vertices_[v]); });
    std::vector<Vec3f> total = direct_;
    for_each(total.size(), [&](std::size_t p) { total[p] += reflected(at_[p]); });
    for_each(out_.point_light.size(), [&](std::size_t p) { out_.point_light[p] += total[p] - direct_[p]; });
    probe(total, [&](std::uint32_t v) { return spread_of(basis, light.gathered, site_of(vertices_[v])); });
    out_.surface->set_light(std::move(total), threads_);
  }

  /// Of a value of the finest level that was gathered everywhere around: what coarser ones add cancels.
  static float spread_of(const MeshlessBasis& basis, const std::vector<char>& gathered, const SurfaceSite& site) {
    std::vector<BasisTerm> terms;
    for (std::size_t level = basis.levels(); level-- > 0;) {
      terms.clear();
      float sum = 0;
      basis.terms_of(level, site, terms);
      for (const BasisTerm& t : terms) sum += gathered[t.function] != 0 ? t.value * t.value : 2;
      if (sum > 0 && sum <= 1) return sum;
    }
    return 1;
  }

  /// Share of the light in a geometric series whose last two terms are known.
  static double beyond(double last, double before, double light) {
    constexpr double kSlowest = 0.99;
    const double ratio = before > 0 ? std::min(kSlowest, last / before) : 0;
    return light > 0 ? last * ratio / (1 - ratio) / light : 0;
  }

  /// What some vertices would gather for themselves, twice, beside what they read.
  void probe(const std::vector<Vec3f>& total, const std::function<float(std::uint32_t vertex)>& spread) {
    std::vector<TransferPoint> at;
    for (const std::uint32_t v : params_.probes) at.push_back(vertices_[v]);
    out_.probes.resize(at.size());
    for (const bool again : {false, true}) {
      GatherRows own(out_.surface->paths(), params_.rays, mix64(params_.seed ^ (again ? kSecondDraw : kFirstDraw)));
      own.add(at, threads_, out_.stats.gather_rays);
      for (std::size_t i = 0; i < at.size(); ++i)
        (again ? out_.probes[i].second : out_.probes[i].first) = own.apply(i, total);
    }
    for (std::size_t i = 0; i < at.size(); ++i) {
      out_.probes[i].read = out_.indirect[params_.probes[i]];
      out_.probes[i].spread = spread(params_.probes[i]);
    }
  }

  float spread_of(std::uint32_t vertex) const {
    if (reading_->of_vertex(vertex).empty()) return 1;
    float sum = 0;
    for (const BasisTerm& t : reading_->of_vertex(vertex)) sum += t.value * t.value;
    return sum;
  }

  /// Reflected light of the vertices, turned to their normals.
  void read_vertices(const std::vector<Vec3f>& gathered, const std::vector<Vec3f>& total) {
    std::vector<VectorValue> turned(receiver_.size());
    for_each(turned.size(), [&](std::size_t r) {
      if (params_.vector) turned[r] = rows_->apply_vector(r, at_[receiver_[r]], total);
      turned[r].value = gathered[r];  // the sweeps' own, to which the rest of the series may have been added
    });
    for_each(vertices_.size(), [&](std::size_t v) {
      const Vec3f& normal = vertices_[v].normal;
      for (const BasisTerm& t : reading_->of_vertex(v)) out_.indirect[v] += turned[t.function].at(normal) * t.value;
    });
    const std::vector<std::uint32_t>& alone = reading_->alone();
    for_each(alone.size(), [&](std::size_t i) { out_.indirect[alone[i]] = rows_->apply(first_alone_ + i, total); });
  }

  /// Direct and reflected light at all points.
  void spread(const std::vector<Vec3f>& gathered, std::vector<Vec3f>& total) {
    for_each(total.size(), [&](std::size_t s) { total[s] = direct_[s] + sum_of(reading_->of_point(s), gathered); });
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
  DirectLight light_, rough_light_;      // at vertices, at points
  std::vector<TransferPoint> vertices_;  // and the other places
  std::vector<TransferPoint> at_;        // the points
  std::optional<GatherRows> rows_;       // of the receivers, then of vertices that are alone
  std::vector<Vec3f> direct_;            // at the points
  std::vector<std::uint32_t> receiver_;  // the point of each row
  std::vector<Vec3f> first_bounce_;      // at the receivers
  float limit_ = 0;                      // of a prediction's error
  std::optional<SurfaceReading> reading_;
  std::size_t first_alone_ = 0;  // of the rows
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
