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

}  // namespace

class ReflectedLight::Solver {
 public:
  Solver(const Tracer& tracer, const Environment* sky, const Radiosity& params, std::span<const TransferPoint> readers,
         Threads& threads)
      : tracer_(tracer), params_(params), threads_(&threads) {
    begin_stage("points");
    PointPlacement placement = params.points;
    if (params.paper) placement.both_sides = kMaxPointLevels;  // a hit reads its own side, with no path to lead on
    surface_ = std::make_unique<LitSurface>(tracer, sky, LitSurface::Points{placement, readers}, threads);
    for (const MeshlessPoint& p : points().points) at_.push_back(transfer_point(p));
    rows_.emplace(surface_->paths(), params.rays, params.seed);
    stats_.points = level_sizes(points());
    stats_.gathered.resize(points().levels());
    begin_stage("direct");
    if (params_.light_points) point_light_ = direct_at_points(DirectLight(tracer, sky, params.direct));
    if (params_.bounces == 0) return;
    direct_ = direct_at_points(DirectLight(tracer, sky, params.direct.rough()));
    if (params_.paper) {
      solve_as_the_paper();
    } else {
      begin_stage("gather");
      gather_adaptively();
      begin_stage("basis");
      prepare_reading();
      begin_stage("sweeps");
      iterate();
    }
    surface_->set_light(total_, threads);
    rows_.reset();
  }

  std::vector<Vec3f> at(std::span<const TransferPoint> places, Threads& threads) {
    std::vector<Vec3f> out(places.size());
    if (params_.bounces == 0) return out;
    std::vector<char> alone(places.size());
    threads_ = &threads;
    for_each(places.size(), [&](std::size_t i) {
      std::vector<BasisTerm> terms;
      if (!params_.paper) reading_->of_place(places[i], terms);
      alone[i] = !params_.paper && terms.empty() ? 1 : 0;
      for (const BasisTerm& t : terms) out[i] += turned_[t.function].at(places[i].normal) * t.value;
      if (params_.paper) out[i] = on_basis(places[i]);
    });
    std::vector<TransferPoint> own;
    std::vector<std::size_t> whose;
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (alone[i] != 0) own.push_back(places[i]), whose.push_back(i);
    }
    const std::vector<Vec3f> light = gather_at(own, params_.seed);
    for (std::size_t i = 0; i < own.size(); ++i) out[whose[i]] = light[i];
    stats_.alone += own.size();
    return out;
  }

  std::vector<GatherProbe> probe(std::span<const TransferPoint> places, Threads& threads) {
    if (params_.bounces == 0) return {};
    const std::vector<Vec3f> read = at(places, threads), first = gather_at(places, mix64(params_.seed ^ kFirstDraw)),
                             second = gather_at(places, mix64(params_.seed ^ kSecondDraw));
    std::vector<GatherProbe> out;
    for (std::size_t i = 0; i < places.size(); ++i) out.push_back({read[i], first[i], second[i], spread_of(places[i])});
    return out;
  }

  const PointHierarchy& points() const { return surface_->points(); }
  const RadiosityStats& stats() const { return stats_; }
  const std::vector<Vec3f>& point_light() const { return point_light_; }
  const LitSurface* surface() const { return params_.bounces == 0 ? nullptr : surface_.get(); }
  std::unique_ptr<LitSurface> take_surface() { return params_.bounces == 0 ? nullptr : std::move(surface_); }

 private:
  void begin_stage(std::string_view name) const {
    if (params_.stage) params_.stage(name);
  }

  std::vector<Vec3f> direct_at_points(const DirectLight& light) {
    return light_at(at_, light, params_.seed, stats_.direct_rays, *threads_);
  }

  /// What places gather for themselves.
  std::vector<Vec3f> gather_at(std::span<const TransferPoint> places, std::uint64_t seed) {
    constexpr std::size_t kAtATime = 4096;  // rows are not kept
    std::vector<Vec3f> out(places.size());
    for (std::size_t first = 0; first < places.size(); first += kAtATime) {
      const auto some = places.subspan(first, std::min(kAtATime, places.size() - first));
      GatherRows own(surface_->paths(), params_.rays, seed);
      own.add(some, *threads_, stats_.gather_rays);
      for_each(some.size(), [&](std::size_t i) { out[first + i] = own.apply(i, total_); });
    }
    return out;
  }

  /// Gathers at points and keeps what one bounce brings there.
  void gather(std::span<const std::uint32_t> points) {
    const std::size_t first = receiver_.size();
    receiver_.insert(receiver_.end(), points.begin(), points.end());
    std::vector<TransferPoint> places;
    for (const std::uint32_t p : points) places.push_back(at_[p]);
    rows_->add(places, *threads_, stats_.gather_rays);
    first_bounce_.resize(receiver_.size());
    threads_->for_blocks(places.size(), kBlock, [&](std::size_t begin, std::size_t end) {
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
                       *threads_);
  }

  /// How points and places get reflected light from the receivers. Points that see none gather for themselves.
  void prepare_reading() {
    const SurfaceReading::Surface surface{tracer_, points(), surface_->paths().world().senders, {}};
    reading_ = std::make_unique<SurfaceReading>(SurfaceReading::of_all(
        surface, receiver_, params_.neighbours, [this](std::span<const std::uint32_t> some) { gather(some); },
        *threads_));
    stats_.gathered = count_by_level(points(), receiver_);
  }

  /// The Neumann series i_{k+1} = c + T (e + i_k), mixed after its first terms, and the reading of its limit.
  void iterate() {
    std::vector<Vec3f> gathered(receiver_.size()), next(receiver_.size());
    total_ = direct_;
    AndersonMixing mixing;
    double before = 0, ratio = 0;
    const bool automatic = params_.bounces < 0;
    const int most = automatic ? kMostSweeps : params_.bounces;
    for (int sweep = 0; sweep < most; ++sweep) {
      if (sweep > 0) spread(gathered);
      for_each(next.size(), [&](std::size_t r) { next[r] = rows_->apply(r, total_); });
      double change = 0, light = 0;
      for (std::size_t r = 0; r < next.size(); ++r) {
        const Vec3f d = next[r] - gathered[r];
        change += (std::abs(double{d.x}) + std::abs(double{d.y}) + std::abs(double{d.z})) / 3;
        light += mean_of(next[r]) + mean_of(direct_[receiver_[r]]);
      }
      stats_.sweeps = sweep + 1;
      const bool plain = !automatic || sweep < kPlainSweeps;
      if (!automatic) stats_.tail = beyond(change, before > 0 ? before : light - change, light);
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
    if (automatic) spread(gathered);
    for_each(point_light_.size(), [&](std::size_t p) { point_light_[p] += sum_of(reading_->of_point(p), gathered); });
    turned_.resize(receiver_.size());
    for_each(turned_.size(), [&](std::size_t r) {
      if (params_.vector) turned_[r] = rows_->apply_vector(r, at_[receiver_[r]], total_);
      turned_[r].value = gathered[r];  // the sweeps' own, to which the rest of the series may have been added
    });
  }

  /// The paper's scheme, on all points but those that were asked for.
  void solve_as_the_paper() {
    begin_stage("basis");
    const std::vector<std::uint32_t> ends(points().level_end.begin(),
                                          points().level_end.begin() + points().placed_levels());
    const std::size_t placed = ends.empty() ? 0 : ends.back();
    std::vector<SurfaceSite> sites;
    for (std::size_t p = 0; p < placed; ++p) sites.push_back(points().points[p].site);
    basis_.emplace(sites, ends, *threads_, params_.neighbours);
    begin_stage("bounces");
    const SenderPaths::World& world = surface_->paths().world();
    PaperLight light =
        bounce_on_basis({tracer_, world.faces, world.albedo, points().cover}, *basis_, std::span(at_).first(placed),
                        std::span(direct_).first(placed),
                        {params_.rays, params_.eps, *params_.paper, params_.bounces, params_.seed}, *threads_);
    stats_.gather_rays += light.rays;
    stats_.sweeps = light.bounces;
    stats_.tail = light.tail;
    for (std::uint32_t p = 0; p < placed; ++p) {
      if (light.gathered[p] != 0) receiver_.push_back(p);
    }
    stats_.gathered = count_by_level(points(), receiver_);
    coefficients_ = std::move(light.coefficients);
    gathered_ = std::move(light.gathered);
    begin_stage("reading");
    total_ = direct_;
    for_each(total_.size(), [&](std::size_t p) { total_[p] += on_basis(at_[p]); });
    for_each(point_light_.size(), [&](std::size_t p) { point_light_[p] += total_[p] - direct_[p]; });
  }

  SurfaceSite site_of(const TransferPoint& p) const {
    return {p.position, p.normal, group_of(tracer_, p, points().cover)};
  }

  Vec3f on_basis(const TransferPoint& p) const {
    const Vec3f x = basis_->evaluate(coefficients_, site_of(p), basis_->levels());
    return {std::max(0.0F, x.x), std::max(0.0F, x.y), std::max(0.0F, x.z)};
  }

  float spread_of(const TransferPoint& place) const {
    std::vector<BasisTerm> terms;
    if (params_.paper) return spread_on_basis(site_of(place));
    reading_->of_place(place, terms);
    float sum = 0;
    for (const BasisTerm& t : terms) sum += t.value * t.value;
    return terms.empty() ? 1 : sum;
  }

  /// Of a value of the finest level that was gathered everywhere around: what coarser ones add cancels.
  float spread_on_basis(const SurfaceSite& site) const {
    std::vector<BasisTerm> terms;
    for (std::size_t level = basis_->levels(); level-- > 0;) {
      terms.clear();
      float sum = 0;
      basis_->terms_of(level, site, terms);
      for (const BasisTerm& t : terms) sum += gathered_[t.function] != 0 ? t.value * t.value : 2;
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

  /// Direct and reflected light at all points.
  void spread(const std::vector<Vec3f>& gathered) {
    for_each(total_.size(), [&](std::size_t s) { total_[s] = direct_[s] + sum_of(reading_->of_point(s), gathered); });
  }

  template <class F>
  void for_each(std::size_t count, const F& f) {
    threads_->for_blocks(count, kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) f(i);
    });
  }

  const Tracer& tracer_;
  const Radiosity params_;
  Threads* threads_;  // of the call under way
  std::unique_ptr<LitSurface> surface_;
  std::vector<TransferPoint> at_;            // the points
  std::optional<GatherRows> rows_;           // of the receivers, until it is solved
  std::vector<Vec3f> direct_, total_;        // at the points
  std::vector<std::uint32_t> receiver_;      // the point of each row
  std::vector<Vec3f> first_bounce_;          // at the receivers
  float limit_ = 0;                          // of a prediction's error
  std::unique_ptr<SurfaceReading> reading_;  // of rows:
  std::vector<VectorValue> turned_;          // light of the receivers as it is read
  std::optional<MeshlessBasis> basis_;       // of the paper's scheme:
  std::vector<Vec3f> coefficients_;          // reflected light
  std::vector<char> gathered_;               // points
  std::vector<Vec3f> point_light_;
  RadiosityStats stats_;
};

ReflectedLight::ReflectedLight(const Tracer& tracer, const Environment* sky, const Radiosity& params,
                               std::span<const TransferPoint> readers, Threads& threads) {
  EXPECTS(params.rays >= 1 && params.rays <= 65536 && params.neighbours >= 1 && params.uniform_levels >= 1);
  solver_ = std::make_unique<Solver>(tracer, sky, params, readers, threads);
}

ReflectedLight::~ReflectedLight() = default;

std::vector<Vec3f> ReflectedLight::at(std::span<const TransferPoint> places, Threads& threads) {
  return solver_->at(places, threads);
}

std::vector<GatherProbe> ReflectedLight::probe(std::span<const TransferPoint> places, Threads& threads) {
  return solver_->probe(places, threads);
}

const RadiosityStats& ReflectedLight::stats() const { return solver_->stats(); }
const PointHierarchy& ReflectedLight::points() const { return solver_->points(); }
const std::vector<Vec3f>& ReflectedLight::point_light() const { return solver_->point_light(); }
const LitSurface* ReflectedLight::surface() const { return solver_->surface(); }
std::unique_ptr<LitSurface> ReflectedLight::take_surface() { return solver_->take_surface(); }

RadiosityResult solve_radiosity(const Tracer& tracer, const Environment* sky, const Radiosity& params,
                                Threads& threads) {
  const std::vector<TransferPoint> vertices = vertex_points(tracer.scene().mesh);
  ReflectedLight reflected(tracer, sky, params, vertices, threads);
  RadiosityResult out;
  if (params.stage) params.stage("reading");
  out.indirect = reflected.at(vertices, threads);
  out.stats = reflected.stats();
  if (params.stage) params.stage("direct");
  out.direct = light_at(vertices, DirectLight(tracer, sky, params.direct), params.seed, out.stats.direct_rays, threads);
  out.surface = reflected.take_surface();
  return out;
}

}  // namespace kiln
