#include "core/meshless/transfer_sweeps.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/base/expects.h"
#include "core/base/random.h"
#include "core/meshless/adaptive_points.h"
#include "core/meshless/gather_rows.h"
#include "core/meshless/lit_surface.h"
#include "core/meshless/surface_reading.h"

namespace kiln {
namespace {

constexpr std::size_t kBlock = 64;

/// Vectors of many places, each a row.
class Table {
 public:
  Table() = default;
  Table(std::size_t rows, std::size_t width) : width_(width), numbers_(rows * width) {}
  void resize(std::size_t rows) { numbers_.resize(rows * width_); }
  float* row(std::size_t r) { return numbers_.data() + r * width_; }
  const float* row(std::size_t r) const { return numbers_.data() + r * width_; }

 private:
  std::size_t width_ = 0;
  std::vector<float> numbers_;
};

class Solver {
 public:
  Solver(const Tracer& tracer, const std::vector<float>& direct, const std::vector<Vec3f>& fixed,
         const TransferSweeps& params, Threads& threads)
      : tracer_(tracer),
        params_(params),
        threads_(threads),
        direct_(direct),
        fixed_(fixed),
        count_(static_cast<std::size_t>(sh_count(params.sky.order))),
        vertices_(vertex_points(tracer.scene().mesh)) {
    for (const StandIn& s : params.stand_ins) vertices_[s.vertex] = s.point;
    begin_stage("points");
    surface_.emplace(tracer, nullptr, LitSurface::Points{params.points, vertices_}, threads);
    for (const MeshlessPoint& p : points().points) at_.push_back(transfer_point(p));
    out_.transfer = {.order = params.sky.order, .channels = 3, .fixed = !fixed.empty(), .coefficients = {}};
  }

  SweptTransfer solve() {
    begin_stage("direct");
    find_direct();
    begin_stage("gather");
    rows_.emplace(surface_->paths(), params_.rays, params_.seed);
    gather_adaptively();
    begin_stage("basis");
    prepare_reading();
    begin_stage("sweeps");
    iterate();
    read_vertices();
    draw_probes_twice();
    return std::move(out_);
  }

 private:
  const PointHierarchy& points() const { return surface_->points(); }
  std::size_t width() const { return out_.transfer.stride(); }
  std::size_t slots() const { return static_cast<std::size_t>(out_.transfer.slots()); }
  std::size_t channels() const { return static_cast<std::size_t>(out_.transfer.channels); }

  void begin_stage(std::string_view name) const {
    if (params_.stage) params_.stage(name);
  }

  /// Direct light as a row of the result.
  void put_direct(const float* sky, const Vec3f& lamps, float* row) const {
    for (std::size_t c = 0; c < channels(); ++c, row += slots()) {
      std::copy_n(sky, count_, row);
      if (out_.transfer.fixed) row[count_] = lamps[c];
    }
  }

  void find_direct() {
    TransferStats stats;
    const std::vector<float> sky = bake_direct_transfer(tracer_, at_, params_.sky, threads_, &stats);
    std::vector<Vec3f> lamps(at_.size());
    if (out_.transfer.fixed) {
      lamps = bake_fixed_direct(tracer_, at_, params_.lamps, threads_, &stats);
      std::vector<Vec3f> all = lamps;
      all.insert(all.end(), fixed_.begin(), fixed_.end());
      out_.transfer.channels = transfer_channels(surface_->faces(), tracer_.scene(), all);
    } else {
      out_.transfer.channels = transfer_channels(surface_->faces(), tracer_.scene(), {});
    }
    out_.stats.direct_rays = stats.rays;
    at_points_ = Table(at_.size(), width());
    for (std::size_t p = 0; p < at_.size(); ++p) put_direct(&sky[p * count_], lamps[p], at_points_.row(p));
    total_ = at_points_;
    gathered_ = Table(0, width());
  }

  // --- gathering

  /// Equation 1's (K T) from one row. `turn` is null or takes the three vectors of turning (gather_rows.h), each as
  /// wide as the value.
  void apply(const GatherRows& rows, std::size_t row, const TransferPoint& point, const Table& light, float* value,
             float* turn) const {
    std::fill_n(value, width(), 0.0F);
    const float unit = 1.0F / (65535.0F * static_cast<float>(rows.rays()));
    for (const RowEntry& e : rows.entries(row)) {
      const Vec3f weight{unit * static_cast<float>(e.albedo[0]), unit * static_cast<float>(e.albedo[1]),
                         unit * static_cast<float>(e.albedo[2])};
      add(light.row(e.sender), weight, value);
    }
    if (turn != nullptr) {
      std::fill_n(turn, 3 * width(), 0.0F);
      for (const GatherRows::Ray& ray : rows.rays_of(row, point)) {
        for (std::size_t axis = 0; axis < 3; ++axis)
          add(light.row(ray.sender), ray.value * ray.aside[axis], turn + axis * width());
      }
    }
    for (std::size_t c = 0; c < channels() && out_.transfer.fixed; ++c)
      value[c * slots() + count_] += rows.constant(row)[c];
  }

  void add(const float* light, const Vec3f& weight, float* sum) const {
    for (std::size_t c = 0; c < channels(); ++c, light += slots(), sum += slots()) {
      const float w = weight[c];
      for (std::size_t i = 0; i < slots(); ++i) sum[i] += w * light[i];
    }
  }

  /// Rows of points, and what one reflection brings there.
  void gather(std::span<const std::uint32_t> points) {
    const std::size_t first = receiver_.size();
    receiver_.insert(receiver_.end(), points.begin(), points.end());
    std::vector<TransferPoint> places;
    for (const std::uint32_t p : points) places.push_back(at_[p]);
    rows_->add(places, threads_, out_.stats.gather_rays);
    gathered_.resize(receiver_.size());
    for_each(first, receiver_.size(),
             [&](std::size_t r) { apply(*rows_, r, at_[receiver_[r]], at_points_, gathered_.row(r), nullptr); });
    measure_mean();
  }

  /// Mean light at the receivers, from a constant sky of 1 and from the lamps.
  void measure_mean() {
    double sky = 0, lamps = 0;
    for (std::size_t r = 0; r < receiver_.size(); ++r) {
      for (std::size_t c = 0; c < channels(); ++c) {
        const std::size_t at = c * slots();
        const float *own = at_points_.row(receiver_[r]) + at, *reflected = gathered_.row(r) + at;
        sky += double{own[0]} + reflected[0];
        if (out_.transfer.fixed) lamps += double{own[count_]} + reflected[count_];
      }
    }
    const auto all = static_cast<double>(std::max<std::size_t>(1, receiver_.size() * channels()));
    mean_sky_ = std::max(2 * std::sqrt(std::numbers::pi) * sky / all, kFaint);
    mean_lamps_ = lamps / all;
  }

  /// RECEIVER-ORACLE for vectors: the error under light of the given power in each band, relative to the mean light.
  bool mispredicted(std::size_t r, std::span<const BasisTerm> prediction) const {
    std::vector<float> difference(gathered_.row(r), gathered_.row(r) + width());
    for (const BasisTerm& t : prediction) {
      const float* other = gathered_.row(t.function);
      for (std::size_t i = 0; i < width(); ++i) difference[i] -= t.value * other[i];
    }
    double sky = 0, lamps = 0;
    for (std::size_t c = 0; c < channels(); ++c) {
      const float* d = &difference[c * slots()];
      for (std::size_t i = 0, band = 0; i < count_; ++i) {
        if (i == (band + 1) * (band + 1)) ++band;
        sky += double{params_.sky.band_power[band]} * d[i] * d[i];
      }
      if (out_.transfer.fixed) lamps = std::max(lamps, std::abs(double{d[count_]}));
    }
    sky = std::sqrt(sky / static_cast<double>(channels()));
    const auto eps = double{params_.eps};
    return sky > eps * mean_sky_ || lamps > eps * mean_lamps_;
  }

  void gather_adaptively() {
    compute_adaptively(
        {.tracer = tracer_,
         .points = points(),
         .uniform_levels = params_.uniform_levels,
         .neighbours = params_.neighbours,
         .compute = [this](std::span<const std::uint32_t> some) { gather(some); },
         .wrong = [this](std::size_t r, std::span<const BasisTerm> terms) { return mispredicted(r, terms); }},
        threads_);
  }

  void prepare_reading() {
    const SurfaceReading::Surface surface{tracer_, points(), surface_->paths().world().senders, vertices_};
    reading_ = std::make_unique<SurfaceReading>(SurfaceReading::of_all(
        surface, receiver_, params_.neighbours, [this](std::span<const std::uint32_t> some) { gather(some); },
        threads_));
    std::vector<TransferPoint> own;
    for (const std::uint32_t v : reading_->alone()) own.push_back(vertices_[v]);
    rows_->add(own, threads_, out_.stats.gather_rays);
    out_.stats.alone = own.size();
    out_.stats.points = level_sizes(points());
    out_.stats.gathered = count_by_level(points(), receiver_);
  }

  // --- the series

  /// Leaves in total_ what the last reflection gathers.
  void iterate() {
    for (int sweep = 1; sweep < params_.bounces; ++sweep) {
      for_each(0, at_.size(), [&](std::size_t p) {
        float* to = total_.row(p);
        std::copy_n(at_points_.row(p), width(), to);
        for (const BasisTerm& t : reading_->of_point(p)) {
          const float* from = gathered_.row(t.function);
          for (std::size_t i = 0; i < width(); ++i) to[i] += t.value * from[i];
        }
        limit_transfer(out_.transfer, to);
      });
      if (sweep + 1 == params_.bounces) break;
      for_each(0, receiver_.size(),
               [&](std::size_t r) { apply(*rows_, r, at_[receiver_[r]], total_, gathered_.row(r), nullptr); });
    }
  }

  /// What the last reflection brings to each receiver, with its turning: value, then three vectors.
  Table turned(const GatherRows& rows, std::span<const std::uint32_t> receivers) const {
    Table out(receivers.size(), 4 * width());
    for_each(0, receivers.size(),
             [&](std::size_t r) { apply(rows, r, at_[receivers[r]], total_, out.row(r), out.row(r) + width()); });
    return out;
  }

  void add_turned(const float* from, float weight, const Vec3f& normal, float* to) const {
    for (std::size_t i = 0; i < width(); ++i) {
      const float turn =
          normal.x * from[width() + i] + normal.y * from[2 * width() + i] + normal.z * from[3 * width() + i];
      to[i] += weight * (from[i] + turn);
    }
  }

  void read_vertices() {
    const Table receivers = turned(*rows_, receiver_);
    out_.transfer.coefficients.resize(vertices_.size() * width());
    const auto row = [&](std::size_t v) { return &out_.transfer.coefficients[v * width()]; };
    for_each(0, vertices_.size(), [&](std::size_t v) {
      for (const BasisTerm& t : reading_->of_vertex(v))
        add_turned(receivers.row(t.function), t.value, vertices_[v].normal, row(v));
    });
    const std::vector<std::uint32_t>& alone = reading_->alone();
    for_each(0, alone.size(), [&](std::size_t i) {
      apply(*rows_, receiver_.size() + i, vertices_[alone[i]], total_, row(alone[i]), nullptr);
    });
    for_each(0, vertices_.size(), [&](std::size_t v) {
      std::vector<float> direct(width());
      put_direct(&direct_[v * count_], out_.transfer.fixed ? fixed_[v] : Vec3f{}, direct.data());
      for (std::size_t c = 0; c < channels() && out_.transfer.fixed; ++c) {
        float& lamps = row(v)[c * slots() + count_];
        lamps = std::max(lamps, 0.0F);
      }
      for (std::size_t i = 0; i < width(); ++i) row(v)[i] += direct[i];
      limit_transfer(out_.transfer, row(v));
    });
  }

  // --- noise

  /// Reads probes from rows drawn anew, and from the first ones: the second minus the first.
  void draw_probes_twice() {
    std::vector<std::uint32_t> some;  // receivers that probes read
    for (const std::uint32_t v : params_.probes) {
      for (const BasisTerm& t : reading_->of_vertex(v)) some.push_back(t.function);
    }
    std::ranges::sort(some);
    some.erase(std::unique(some.begin(), some.end()), some.end());
    const std::uint64_t seed = mix64(params_.seed ^ 0x6e6f697365ULL);
    GatherRows again(surface_->paths(), params_.rays, seed);
    std::vector<TransferPoint> places;
    std::vector<std::uint32_t> at;
    for (const std::uint32_t r : some) at.push_back(receiver_[r]), places.push_back(at_[receiver_[r]]);
    again.add(places, threads_, out_.stats.gather_rays);
    const Table second = turned(again, at);
    Table first(some.size(), 4 * width());
    for_each(0, some.size(),
             [&](std::size_t k) { apply(*rows_, some[k], at_[at[k]], total_, first.row(k), first.row(k) + width()); });
    out_.noise.difference.assign(params_.probes.size() * 3 * slots(), 0.0F);
    std::vector<float> sum(width());
    for (std::size_t p = 0; p < params_.probes.size(); ++p) {
      std::ranges::fill(sum, 0.0F);
      for (const BasisTerm& t : reading_->of_vertex(params_.probes[p])) {
        const auto k = static_cast<std::size_t>(std::ranges::lower_bound(some, t.function) - some.begin());
        const Vec3f& normal = vertices_[params_.probes[p]].normal;
        add_turned(second.row(k), t.value, normal, sum.data());
        add_turned(first.row(k), -t.value, normal, sum.data());
      }
      for (std::size_t c = 0; c < 3; ++c)
        std::copy_n(&sum[channels() == 1 ? 0 : c * slots()], slots(), &out_.noise.difference[(3 * p + c) * slots()]);
    }
  }

  template <class F>
  void for_each(std::size_t first, std::size_t end, const F& f) const {
    threads_.for_blocks(end - first, kBlock, [&](std::size_t a, std::size_t b) {
      for (std::size_t i = a; i < b; ++i) f(first + i);
    });
  }

  static constexpr double kFaint = 0.01;  // of an open point: less light than that counts as that

  const Tracer& tracer_;
  const TransferSweeps& params_;
  Threads& threads_;
  const std::vector<float>& direct_;  // of the vertices
  const std::vector<Vec3f>& fixed_;
  const std::size_t count_;
  std::vector<TransferPoint> vertices_;
  std::optional<LitSurface> surface_;
  std::vector<TransferPoint> at_;        // the points
  Table at_points_, total_;              // direct light; what the next reflection gathers
  std::optional<GatherRows> rows_;       // of the receivers, then of vertices that are alone
  std::vector<std::uint32_t> receiver_;  // the point of each row
  Table gathered_;                       // of the receivers
  double mean_sky_ = 1, mean_lamps_ = 0;
  std::unique_ptr<SurfaceReading> reading_;
  SweptTransfer out_;
};

}  // namespace

SweptTransfer sweep_transfer(const Tracer& tracer, const std::vector<float>& direct,
                             const std::vector<Vec3f>& fixed_direct, const TransferSweeps& params, Threads& threads) {
  const std::size_t vertices = tracer.scene().mesh.position.size();
  EXPECTS(params.bounces >= 1 && params.rays >= 1 && params.rays <= 65536);
  EXPECTS(params.sky.band_power.size() == static_cast<std::size_t>(params.sky.order));
  EXPECTS(direct.size() == vertices * static_cast<std::size_t>(sh_count(params.sky.order)));
  EXPECTS(fixed_direct.empty() || fixed_direct.size() == vertices);
  return Solver(tracer, direct, fixed_direct, params, threads).solve();
}

}  // namespace kiln
