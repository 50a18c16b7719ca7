#include "core/meshless/glossy_points.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numeric>
#include <optional>

#include "core/base/expects.h"
#include "core/meshless/adaptive_points.h"
#include "core/meshless/linear_weights.h"
#include "core/meshless/reading.h"
#include "core/prt/gather_faces.h"
#include "core/sphere/quadrature.h"
#include "core/sphere/sh.h"

namespace kiln {
namespace {

constexpr std::size_t kBlock = 32;
constexpr std::size_t kRedrawn = 128;  // matrices that are drawn twice, to see their noise

/// Weights of the open point's matrix, for any normal: they are polynomials of degree 2 (order - 1), as the matrix is
/// the product of harmonics with a half space.
class OpenWeights {
 public:
  OpenWeights(const GlossyMatrixBaker& baker, const GlossyComponents& components, int order)
      : bands_(2 * order - 1), rank_(components.rank()), table_(rank_ * count()) {
    EXPECTS(bands_ <= kMaxShOrder);
    std::vector<float> matrix(baker.stride()), weights(rank_);
    std::vector<double> sums(table_.size()), y(count());
    double left = 0;
    for (const SphereNode& node : sphere_quadrature(2 * (bands_ - 1))) {
      baker.open(to_float(node.direction), matrix.data());
      components.project(matrix, weights.data(), &left);
      evaluate_sh(bands_, node.direction, y.data());
      for (std::size_t i = 0; i < count(); ++i) {
        for (std::size_t k = 0; k < rank_; ++k) sums[i * rank_ + k] += node.weight * y[i] * weights[k];
      }
    }
    std::ranges::transform(sums, table_.begin(), [](double x) { return static_cast<float>(x); });
  }

  /// out += sign * weights.
  void add(const Vec3f& normal, float sign, float* out) const {
    std::array<float, sh_count(kMaxShOrder)> y;
    evaluate_sh(bands_, normal, y.data());
    for (std::size_t i = 0; i < count(); ++i) {
      for (std::size_t k = 0; k < rank_; ++k) out[k] += sign * y[i] * table_[i * rank_ + k];
    }
  }

 private:
  std::size_t count() const { return static_cast<std::size_t>(sh_count(bands_)); }

  int bands_;
  std::size_t rank_;
  std::vector<float> table_;  // [harmonic of the normal][weight]
};

class Solver {
 public:
  Solver(const Tracer& tracer, const Transfer& light, std::span<const std::uint32_t> vertices,
         const GlossyPoints& params, Threads& threads, GlossyPointStats& stats)
      : tracer_(tracer),
        params_(params),
        threads_(threads),
        stats_(stats),
        vertices_(vertices),
        baker_(tracer, light, params.bake.matrix),
        redrawn_(tracer, light, another_draw(params.bake.matrix)) {
    begin_stage("points");
    points_ = place_points(tracer, GatherFaces(tracer.scene()), params.points, threads);
    for (const MeshlessPoint& p : points_.points) at_.push_back(transfer_point(p));
    const GlossyMatrix& shape = params.bake.matrix;
    out_.transfer = {shape.order, shape.channels, shape.fixed, {}, {vertices.begin(), vertices.end()}, {}};
  }

  bool none() const { return points_.points.empty(); }

  GlossyBaked solve() {
    find_components();
    const std::vector<std::uint32_t> computed = compute();
    read_vertices();
    stats_.points = level_sizes(points_);
    stats_.computed = count_by_level(points_, computed);
    return std::move(out_);
  }

 private:
  std::size_t rank() const { return components_->rank(); }

  void begin_stage(std::string_view name) const {
    if (params_.stage) params_.stage(name);
  }

  /// The coarsest points lie evenly over the surface.
  void find_components() {
    begin_stage("rays");
    const std::span<const TransferPoint> first = std::span(at_).first(std::min(kGlossySamples, at_.size()));
    samples_ = baker_.bake(first, threads_, out_.rays);
    components_.emplace(out_.transfer, samples_, params_.bake.rank);
    out_.transfer.components = components_->components();
    open_.emplace(baker_, *components_, params_.bake.matrix.order);
    measure_noise(first.first(std::min(kRedrawn, first.size())));
  }

  void measure_noise(std::span<const TransferPoint> some) {
    const std::vector<float> again = redrawn_.bake(some, threads_, out_.rays);
    const std::span<const float> before = std::span(samples_).first(again.size());
    noise_ = components_->noise(before, again);
    std::vector<float> a(some.size() * rank()), b(a.size());
    std::vector<double> left(some.size());
    components_->project(before, a.data(), left.data());
    components_->project(again, b.data(), left.data());
    double squared = 0;
    for (std::size_t i = 0; i < a.size(); ++i) b[i] = (b[i] - a[i]) * std::sqrt(0.5F);
    for (std::size_t n = 0; n < some.size(); ++n)
      squared += std::pow(components_->norm1(std::span(b).subspan(n * rank(), rank())), 2);
    stats_.noise = static_cast<float>(std::sqrt(squared / static_cast<double>(some.size())));
  }

  /// What surfaces add to the open point's weights, and what components leave out, of places one after the other.
  struct Hidden {
    std::vector<float> weights;
    std::vector<double> left;
  };

  /// Of places that are points of the given number those of the first samples are known; `known` is empty for vertices.
  void add_matrices(std::span<const TransferPoint> places, std::span<const std::uint32_t> known) {
    Hidden& to = hidden_;
    begin_stage("rays");
    const std::size_t first = to.left.size();
    to.left.resize(first + places.size());
    to.weights.resize(to.left.size() * rank());
    std::atomic<std::uint64_t> rays = 0;
    threads_.for_blocks(places.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      const std::size_t stride = baker_.stride();
      std::vector<float> block((end - begin) * stride);
      for (std::size_t k = begin; k < end; ++k) {
        float* matrix = &block[(k - begin) * stride];
        if (!known.empty() && known[k] * stride < samples_.size()) {
          std::copy_n(&samples_[known[k] * stride], stride, matrix);
        } else {
          rays += baker_.bake(places[k], matrix);
        }
      }
      components_->project(block, &to.weights[(first + begin) * rank()], &to.left[first + begin]);
      for (std::size_t k = begin; k < end; ++k) open_->add(places[k].normal, -1, &to.weights[(first + k) * rank()]);
    });
    out_.rays += rays;
    begin_stage("basis");
    done_ += places.size();
    if (params_.bake.progress) params_.bake.progress(done_, std::max(done_, at_.size()));
  }

  std::vector<std::uint32_t> compute() {
    const float limit = std::hypot(params_.eps, stats_.noise);
    return compute_adaptively({.tracer = tracer_,
                               .points = points_,
                               .uniform_levels = params_.uniform_levels,
                               .neighbours = params_.neighbours,
                               .first = samples_.size() / baker_.stride(),
                               .compute =
                                   [this](std::span<const std::uint32_t> some) {
                                     std::vector<TransferPoint> places;
                                     for (const std::uint32_t p : some) {
                                       places.push_back(at_[p]);
                                       sites_.push_back(points_.points[p].site);
                                     }
                                     add_matrices(places, some);
                                   },
                               .wrong =
                                   [this, limit](std::size_t n, std::span<const BasisTerm> prediction) {
                                     std::vector<float> difference(&hidden_.weights[n * rank()],
                                                                   &hidden_.weights[n * rank()] + rank());
                                     for (const BasisTerm& t : prediction)
                                       add_hidden(t.function, -t.value, difference.data());
                                     return components_->norm1(difference) > limit;
                                   }},
                              threads_);
  }

  void add_hidden(std::size_t n, float weight, float* to) const {
    const float* from = &hidden_.weights[n * rank()];
    for (std::size_t k = 0; k < rank(); ++k) to[k] += weight * from[k];
  }

  std::vector<BasisTerm> linear(const Vec3f& position, const Vec3f& normal, std::span<const BasisTerm> terms) const {
    std::vector<BasisTerm> out(terms.begin(), terms.end());
    make_linear(position, normal, sites_, out);
    return out;
  }

  void read_vertices() {
    const std::vector<TransferPoint> places = lit_places(tracer_.scene().mesh, vertices_, params_.bake.stand_ins);
    const Readings readings({tracer_, {sites_, points_.cover, params_.neighbours}, threads_}, places, threads_);

    std::vector<TransferPoint> own;
    std::vector<std::size_t> own_row(places.size(), 0);  // of those that see no point
    for (std::size_t v = 0; v < places.size(); ++v) {
      if (readings.any(v)) continue;
      own_row[v] = sites_.size() + own.size();
      own.push_back(places[v]);
    }
    stats_.alone = own.size();
    add_matrices(own, {});

    out_.transfer.weights.assign(places.size() * rank(), 0.0F);
    std::vector<double> left(places.size()), shrink(places.size(), 1.0);
    threads_.for_blocks(places.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t v = begin; v < end; ++v) {
        float* to = &out_.transfer.weights[v * rank()];
        open_->add(places[v].normal, 1, to);
        if (!readings.any(v)) {
          add_hidden(own_row[v], 1, to);
          left[v] = hidden_.left[own_row[v]];
          continue;
        }
        shrink[v] = 0;
        for (const BasisTerm& t : linear(places[v].position, places[v].normal, readings.terms(v))) {
          add_hidden(t.function, t.value, to);
          left[v] += std::abs(double{t.value}) * hidden_.left[t.function];
          shrink[v] += double{t.value} * t.value;
        }
      }
    });
    const std::vector<double> share = vertex_shares(tracer_.scene().mesh, vertices_);
    out_.left_out = std::sqrt(std::inner_product(share.begin(), share.end(), left.begin(), 0.0));
    out_.noise = noise_ * std::sqrt(std::inner_product(share.begin(), share.end(), shrink.begin(), 0.0));
  }

  const Tracer& tracer_;
  const GlossyPoints& params_;
  Threads& threads_;
  GlossyPointStats& stats_;
  std::span<const std::uint32_t> vertices_;
  const GlossyMatrixBaker baker_, redrawn_;
  PointHierarchy points_;
  std::vector<TransferPoint> at_;
  std::vector<float> samples_;  // matrices of the first points
  std::optional<GlossyComponents> components_;
  std::optional<OpenWeights> open_;
  double noise_ = 0;                // of one matrix
  std::vector<SurfaceSite> sites_;  // of computed points
  Hidden hidden_;                   // of computed points, then of lone vertices
  std::size_t done_ = 0;
  GlossyBaked out_;
};

}  // namespace

std::size_t GlossyPointStats::matrices() const { return std::accumulate(computed.begin(), computed.end(), alone); }

GlossyBaked bake_glossy_on_points(const Tracer& tracer, const Transfer& light, std::span<const std::uint32_t> vertices,
                                  const GlossyPoints& params, Threads& threads, GlossyPointStats& stats) {
  EXPECTS(!vertices.empty() && std::ranges::is_sorted(vertices));
  stats = {};
  Solver solver(tracer, light, vertices, params, threads, stats);
  if (!solver.none()) return solver.solve();
  stats.alone = vertices.size();  // a surface without area
  return bake_glossy(tracer, light, vertices, params.bake, threads);
}

}  // namespace kiln
