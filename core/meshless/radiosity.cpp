#include "core/meshless/radiosity.h"

#include <algorithm>
#include <cmath>

#include "core/base/expects.h"
#include "core/base/random.h"
#include "core/meshless/anderson.h"
#include "core/meshless/cover.h"
#include "core/meshless/demand.h"
#include "core/meshless/gather_rows.h"
#include "core/meshless/point_grid.h"
#include "core/meshless/reading.h"
#include "core/prt/morton.h"
#include "core/prt/ray_origin.h"

namespace kiln {
namespace {

constexpr std::size_t kBlock = 128;
constexpr float kChildReach = 2;    // of the parent level's R: points that a flagged point sends for
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
    out_.surface = std::make_unique<LitSurface>(tracer, sky, LitSurface::Points{params.points, vertices_}, threads);
    for (const MeshlessPoint& p : points().points) {
      sites_.push_back(p.site);
      at_.push_back(transfer_point(p));
    }
    rows_.emplace(out_.surface->paths(), params.rays, params.seed);
  }

  RadiosityResult solve() {
    begin_stage("direct");
    find_direct();
    out_.indirect.resize(vertices_.size());
    for (std::size_t level = 0; level < points().levels(); ++level) {
      out_.stats.points.push_back(points().level_end[level] - points().begin(level));
    }
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
  void gather(std::vector<std::uint32_t> points) {
    std::vector<TransferPoint> places;
    std::vector<Vec3f> positions;
    for (const std::uint32_t p : points) positions.push_back(sites_[p].position);
    const std::size_t first = receiver_.size();
    for (const std::uint32_t i : morton_order(positions)) {
      receiver_.push_back(points[i]);
      places.push_back(at_[points[i]]);
    }
    rows_->add(places, threads_, out_.stats.gather_rays);
    first_bounce_.resize(receiver_.size());
    threads_.for_blocks(places.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t r = first + begin; r < first + end; ++r) first_bounce_[r] = rows_->apply(r, direct_);
    });
    for (const std::uint32_t p : points) ++out_.stats.gathered[level_of(p)];
  }

  std::size_t level_of(std::uint32_t point) const {
    const std::vector<std::uint32_t>& ends = points().level_end;
    return static_cast<std::size_t>(std::upper_bound(ends.begin(), ends.end(), point) - ends.begin());
  }

  /// For what places read of the receivers so far.
  Reading read_receivers() const {
    std::vector<SurfaceSite> some;
    for (const std::uint32_t p : receiver_) some.push_back(sites_[p]);
    return {tracer_, {some, points().cover, params_.neighbours}, threads_};
  }

  std::span<const TransferPoint> places_of(std::uint32_t begin, std::uint32_t end) const {
    return std::span(at_).subspan(begin, end - begin);
  }

  /// COMPUTE-BOUNCE's refinement, for all bounces at once.
  void gather_adaptively() {
    const auto uniform = static_cast<std::size_t>(params_.uniform_levels);
    std::size_t before = 0;             // receivers of the levels above the last one
    std::optional<Readings> predicted;  // of the last level's points, from those receivers
    for (std::size_t level = 0; level < points().levels(); ++level) {
      const std::uint32_t begin = points().begin(level), end = points().level_end[level];
      const bool everywhere = level < uniform || level >= points().placed_levels();
      std::vector<char> chosen(end - begin, everywhere ? 1 : 0);
      std::optional<Readings> seen;
      if (level + 1 >= uniform && level < points().placed_levels())
        seen.emplace(read_receivers(), places_of(begin, end), threads_);
      if (!everywhere) {
        for (const std::uint32_t p : children_of(mispredicted(before, level - 1, *predicted), level))
          chosen[p - begin] = 1;
        for (std::size_t i = 0; i < chosen.size(); ++i) {
          if (!seen->any(i) || sites_[begin + i].group == kCoveredGroup) chosen[i] = 1;
        }
      }
      before = receiver_.size();
      predicted = std::move(seen);
      gather(marked(chosen, begin));
    }
  }

  static std::vector<std::uint32_t> marked(const std::vector<char>& marks, std::uint32_t first) {
    std::vector<std::uint32_t> out;
    for (std::uint32_t i = 0; i < marks.size(); ++i) {
      if (marks[i] != 0) out.push_back(first + i);
    }
    return out;
  }

  /// RECEIVER-ORACLE: points gathered last, of `level`, that those before them do not predict.
  std::vector<std::uint32_t> mispredicted(std::size_t before, std::size_t level, const Readings& predicted) const {
    double mean = 0;
    for (std::size_t r = 0; r < receiver_.size(); ++r) mean += mean_of(first_bounce_[r] + direct_[receiver_[r]]);
    const auto limit =
        static_cast<float>(params_.eps * mean / static_cast<double>(std::max<std::size_t>(1, receiver_.size())));
    std::vector<std::uint32_t> out;
    for (std::size_t r = before; r < receiver_.size(); ++r) {
      const std::size_t i = receiver_[r] - points().begin(level);
      if (level > 0 && !predicted.any(i)) continue;  // of a pocket: finer points there that see nothing gather anyway
      if (largest(first_bounce_[r] - predicted.apply(i, first_bounce_)) > limit) out.push_back(receiver_[r]);
    }
    return out;
  }

  /// The points of a level around points of the level above.
  std::vector<std::uint32_t> children_of(const std::vector<std::uint32_t>& parents, std::size_t level) const {
    const float reach = kChildReach * points().radius[level - 1];
    PointGrid grid(2 * reach);
    for (const std::uint32_t p : parents) grid.add(p, sites_[p].position);
    std::vector<std::uint32_t> out;
    for (std::uint32_t p = points().begin(level); p < points().level_end[level]; ++p) {
      bool near = false;
      grid.near(sites_[p].position, reach, [&](std::uint32_t q, float d2) {
        const float cosine = dot(sites_[p].normal, sites_[q].normal);
        near = near || (sites_[p].group == sites_[q].group && cosine > 0 && d2 <= reach * reach * cosine * cosine);
      });
      if (near) out.push_back(p);
    }
    return out;
  }

  /// How points and vertices get reflected light from the receivers. Points that see none gather for themselves, and
  /// so do vertices that see no point at all.
  void prepare_reading() {
    const auto all = static_cast<std::uint32_t>(sites_.size());
    for (int round = 0; round < 2; ++round) {
      const Reading reading = read_receivers();
      at_points_.emplace(reading, places_of(0, all), threads_);
      at_vertices_.emplace(reading, vertices_, threads_);
      if (gather_unseen() == 0) break;
    }
    receiver_of_.assign(all, kNoReceiver);
    for (std::uint32_t r = 0; r < receiver_.size(); ++r) receiver_of_[receiver_[r]] = r;

    nearest_.assign(vertices_.size(), Senders::kNone);
    for_each(vertices_.size(), [&](std::size_t v) {
      if (at_vertices_->any(v)) return;
      nearest_[v] = out_.surface->paths().world().senders.nearest(reader_site(tracer_, vertices_[v], points().cover));
    });
    std::vector<TransferPoint> own;
    for (std::uint32_t v = 0; v < vertices_.size(); ++v) {
      if (at_vertices_->any(v) || nearest_[v] != Senders::kNone) continue;
      alone_.push_back(v);
      own.push_back(vertices_[v]);
    }
    first_alone_ = rows_->size();
    rows_->add(own, threads_, out_.stats.gather_rays);
    out_.stats.alone = alone_.size();
  }

  /// Points that neither gather nor see one that does.
  std::size_t gather_unseen() {
    std::vector<char> unseen(sites_.size());
    for (std::size_t p = 0; p < unseen.size(); ++p) unseen[p] = at_points_->any(p) ? 0 : 1;
    for (const std::uint32_t p : receiver_) unseen[p] = 0;
    const std::vector<std::uint32_t> found = marked(unseen, 0);
    if (!found.empty()) gather(found);
    return found.size();
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
    for_each(out_.point_light.size(), [&](std::size_t p) {
      const std::uint32_t r = receiver_of_[p];
      out_.point_light[p] += r != kNoReceiver ? gathered[r] : at_points_->apply(p, gathered);
    });
    read_vertices(gathered, total);
    probe(total);
    out_.surface->set_light(std::move(total));
  }

  /// Share of the light in a geometric series whose last two terms are known.
  static double beyond(double last, double before, double light) {
    constexpr double kSlowest = 0.99;
    const double ratio = before > 0 ? std::min(kSlowest, last / before) : 0;
    return light > 0 ? last * ratio / (1 - ratio) / light : 0;
  }

  /// What some vertices would gather for themselves, twice, beside what they read.
  void probe(const std::vector<Vec3f>& total) {
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
      out_.probes[i].spread = spread_of(params_.probes[i]);
    }
  }

  float spread_of(std::uint32_t vertex) const {
    if (nearest_[vertex] != Senders::kNone || !at_vertices_->any(vertex)) return 1;
    float sum = 0;
    for (const BasisTerm& t : at_vertices_->terms(vertex)) sum += t.value * t.value;
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
      const auto read = [&](std::span<const BasisTerm> terms) {
        for (const BasisTerm& t : terms) out_.indirect[v] += turned[t.function].at(normal) * t.value;
      };
      const std::uint32_t nearest = nearest_[v];
      if (nearest == Senders::kNone) {
        read(at_vertices_->terms(v));
      } else if (receiver_of_[nearest] != kNoReceiver) {
        out_.indirect[v] = turned[receiver_of_[nearest]].at(normal);
      } else {
        read(at_points_->terms(nearest));
      }
    });
    for_each(alone_.size(), [&](std::size_t i) { out_.indirect[alone_[i]] = rows_->apply(first_alone_ + i, total); });
  }

  /// Direct and reflected light at all points.
  void spread(const std::vector<Vec3f>& gathered, std::vector<Vec3f>& total) {
    for_each(total.size(), [&](std::size_t s) { total[s] = direct_[s] + at_points_->apply(s, gathered); });
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
  DirectLight light_, rough_light_;      // at vertices, at points
  std::vector<TransferPoint> vertices_;  // and the other places
  std::vector<SurfaceSite> sites_;       // of the points
  std::vector<TransferPoint> at_;
  std::optional<GatherRows> rows_;       // of the receivers, then of `alone_`
  std::vector<Vec3f> direct_;            // at the points
  std::vector<std::uint32_t> receiver_;  // the point of each row
  std::vector<Vec3f> first_bounce_;      // at the receivers
  std::optional<Readings> at_points_, at_vertices_;
  static constexpr std::uint32_t kNoReceiver = 0xffffffffU;
  std::vector<std::uint32_t> receiver_of_;  // of each point
  std::vector<std::uint32_t> nearest_;      // the point that a vertex reads which sees no receiver, or Senders::kNone
  std::vector<std::uint32_t> alone_;        // vertices with rows of their own
  std::size_t first_alone_ = 0;             // of the rows
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
