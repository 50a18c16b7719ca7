#include "core/prt/glossy_bake.h"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>

#include "core/base/expects.h"
#include "core/base/random.h"
#include "core/mesh/topology.h"
#include "core/prt/morton.h"

namespace kiln {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t kBlock = 32;    // vertices of a unit of work
constexpr std::size_t kNews = 2048;   // between two pieces of news
constexpr double kLeastLight = 0.01;  // of the light sent: where less arrives, errors are relative to this

/// A third of each triangle's area at those of its corners that have matrices; they sum to 1.
std::vector<double> vertex_shares(const Mesh& mesh, std::span<const std::uint32_t> vertices) {
  std::vector<double> area(mesh.position.size(), 0.0), out;
  for (const Triangle& t : mesh.triangles) {
    for (const auto v : t) area[v] += triangle_area(mesh, t);
  }
  double sum = 0;
  for (const auto v : vertices) sum += area[v];
  for (const auto v : vertices) out.push_back(sum > 0 ? area[v] / sum : 1 / static_cast<double>(vertices.size()));
  return out;
}

/// Where rays of a vertex start.
class Places {
 public:
  Places(const Mesh& mesh, const std::vector<StandIn>& stand_ins)
      : mesh_(mesh), face_(widest_faces(mesh)), stand_ins_(stand_ins) {}

  TransferPoint at(std::uint32_t v) const {
    const auto found = std::ranges::lower_bound(stand_ins_, v, {}, &StandIn::vertex);
    if (found != stand_ins_.end() && found->vertex == v) return found->point;
    return vertex_point(mesh_, v, face_[v]);
  }

 private:
  const Mesh& mesh_;
  std::vector<std::uint32_t> face_;
  const std::vector<StandIn>& stand_ins_;
};

/// Evenly over the surface: at equal steps of the area, in Morton order. Indices into `vertices`, each at most once.
std::vector<std::size_t> choose_samples(const Mesh& mesh, std::span<const std::uint32_t> vertices,
                                        std::span<const double> share) {
  std::vector<Vec3f> position;
  for (const auto v : vertices) position.push_back(mesh.position[v]);
  std::vector<std::size_t> out;
  double sum = 0;
  std::size_t taken = 0;
  for (const auto n : morton_order(position)) {
    sum += share[n];
    if (sum * kGlossySamples < static_cast<double>(taken) + 0.5 && vertices.size() > kGlossySamples) continue;
    out.push_back(n);
    taken = std::max(taken + 1, static_cast<std::size_t>(sum * kGlossySamples));
  }
  if (out.empty()) out.push_back(0);
  return out;
}

/// Matrices of some vertices, one in each column.
Eigen::MatrixXf matrices_of(const GlossyMatrixBaker& baker, const std::vector<TransferPoint>& points, Threads& threads,
                            std::uint64_t& rays) {
  Eigen::MatrixXf out(static_cast<Index>(baker.stride()), static_cast<Index>(points.size()));
  std::atomic<std::uint64_t> traced = 0;
  threads.for_blocks(points.size(), 1, [&](std::size_t begin, std::size_t) {
    traced += baker.bake(points[begin], out.col(static_cast<Index>(begin)).data());
  });
  rays += traced;
  return out;
}

/// Square roots of what the squared error of each number counts.
VectorXd metric_of(const GlossyTransfer& shape, const Eigen::MatrixXf& matrices, std::span<const double> band_power) {
  const auto outputs = static_cast<std::size_t>(shape.outputs()), inputs = static_cast<std::size_t>(shape.inputs());
  const VectorXd mean = matrices.cast<double>().rowwise().mean().cwiseAbs();
  double sky = 0, lamps = 0;  // mean light that arrives; the first coefficient of a constant 1 is 2 sqrt(pi)
  for (std::size_t c = 0; c < static_cast<std::size_t>(shape.channels); ++c) {
    sky += mean[static_cast<Index>(c * outputs * inputs)] / shape.channels;
    if (shape.fixed) lamps += mean[static_cast<Index>(c * outputs * inputs + outputs)] / shape.channels;
  }
  sky = std::max(sky, kLeastLight);
  lamps /= 2 * std::sqrt(std::numbers::pi);
  VectorXd out(static_cast<Index>(shape.stride()));
  for (std::size_t s = 0; s < shape.stride(); ++s) {
    const std::size_t i = s % inputs;
    const auto band = static_cast<std::size_t>(std::sqrt(static_cast<double>(i) + 0.5));
    const double per_direction = 1 / (4 * std::numbers::pi * shape.channels);
    const double squared = i < outputs ? band_power[band] / (sky * sky) : lamps > 0 ? 1 / (lamps * lamps) : 0;
    out[static_cast<Index>(s)] = std::sqrt(per_direction * squared);
  }
  return out;
}

/// Components and how to find weights.
struct Principal {
  VectorXd mean;   // in numbers of a matrix
  MatrixXd units;  // [number][k]: orthonormal in the metric
};

/// Principal components by the Gram matrix of the samples.
Principal find_principal(const Eigen::MatrixXf& matrices, const VectorXd& metric, const GlossyBake& bake) {
  Principal out{matrices.cast<double>().rowwise().mean(), {}};
  MatrixXd scaled = metric.asDiagonal() * (matrices.cast<double>().colwise() - out.mean);
  scaled /= std::sqrt(static_cast<double>(matrices.cols()));
  const MatrixXd gram = scaled.transpose() * scaled;
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solved(gram);
  EXPECTS(solved.info() == Eigen::Success);
  const VectorXd& values = solved.eigenvalues();  // ascending
  const double largest = std::max(values[values.size() - 1], 0.0);
  double left = values.cwiseMax(0).sum();
  Index rank = 0;
  // Below 1e-12 of the largest an eigenvector is rounding.
  while (rank < values.size() && rank < static_cast<Index>(bake.most) && left > bake.left_out * bake.left_out &&
         values[values.size() - 1 - rank] > 1e-12 * largest) {
    left -= values[values.size() - 1 - rank];
    ++rank;
  }
  rank = std::max<Index>(rank, 1);
  out.units = MatrixXd::Zero(metric.size(), rank);
  for (Index k = 0; k < rank; ++k) {
    const Index at = values.size() - 1 - k;
    if (values[at] > 1e-12 * largest && values[at] > 0)
      out.units.col(k) = scaled * solved.eigenvectors().col(at) / std::sqrt(values[at]);
  }
  return out;
}

/// Back from the metric; where it is 0 (lamps that reach nothing) all matrices are the mean.
Components in_numbers(const Principal& basis, const VectorXd& metric) {
  const auto stride = static_cast<std::size_t>(metric.size()), rank = static_cast<std::size_t>(basis.units.cols());
  Components out{stride, std::vector<float>((rank + 1) * stride, 0.0F)};
  for (std::size_t s = 0; s < stride; ++s) {
    const auto at = static_cast<Index>(s);
    out.rows[s] = static_cast<float>(basis.mean[at]);
    for (std::size_t k = 0; k < rank && metric[at] > 0; ++k)
      out.rows[(k + 1) * stride + s] = static_cast<float>(basis.units(at, static_cast<Index>(k)) / metric[at]);
  }
  return out;
}

/// Weights of blocks of vertices, and the square of what they leave out of each.
class Projector {
 public:
  Projector(const GlossyMatrixBaker& baker, const Principal& basis, const VectorXd& metric)
      : baker_(baker),
        mean_(basis.mean.cast<float>()),
        metric_(metric.cast<float>()),
        units_(basis.units.cast<float>()) {}

  /// Returns the rays it took. `weights` and `left` begin at those of the first point.
  std::uint64_t project(std::span<const TransferPoint> points, float* weights, double* left) const {
    Eigen::MatrixXf block(mean_.size(), static_cast<Index>(points.size()));
    std::uint64_t rays = 0;
    for (std::size_t n = 0; n < points.size(); ++n)
      rays += baker_.bake(points[n], block.col(static_cast<Index>(n)).data());
    block = (metric_.asDiagonal() * (block.colwise() - mean_)).eval();
    const Eigen::MatrixXf found = units_.transpose() * block;
    block -= units_ * found;
    std::copy_n(found.data(), found.size(), weights);
    for (std::size_t n = 0; n < points.size(); ++n)
      left[n] = block.col(static_cast<Index>(n)).cast<double>().squaredNorm();
    return rays;
  }

 private:
  const GlossyMatrixBaker& baker_;
  Eigen::VectorXf mean_, metric_;
  Eigen::MatrixXf units_;
};

/// Relative error of the arriving light from the rays of one draw.
double noise_of(const Eigen::MatrixXf& a, const Eigen::MatrixXf& b, const VectorXd& metric) {
  const MatrixXd difference = metric.asDiagonal() * (b - a).cast<double>();
  return std::sqrt(difference.squaredNorm() / (2.0 * static_cast<double>(a.cols())));
}

}  // namespace

GlossyBaked bake_glossy(const Tracer& tracer, const Transfer& light, std::span<const std::uint32_t> vertices,
                        const GlossyBake& bake, Threads& threads) {
  EXPECTS(!vertices.empty() && std::ranges::is_sorted(vertices));
  EXPECTS(bake.band_power.size() == static_cast<std::size_t>(bake.matrix.order));
  const Mesh& mesh = tracer.scene().mesh;
  const Places places(mesh, bake.stand_ins);
  const std::vector<double> share = vertex_shares(mesh, vertices);
  std::vector<TransferPoint> points, some;
  for (const auto v : vertices) points.push_back(places.at(v));
  for (const std::size_t n : choose_samples(mesh, vertices, share)) some.push_back(points[n]);

  const GlossyMatrixBaker baker(tracer, light, bake.matrix);
  GlossyMatrix redrawn = bake.matrix;
  redrawn.seed = mix64(bake.matrix.seed ^ 0x6e6f697365ULL);
  GlossyBaked out;
  out.transfer = {
      bake.matrix.order, bake.matrix.channels, bake.matrix.fixed, {}, {vertices.begin(), vertices.end()}, {}};
  const Eigen::MatrixXf matrices = matrices_of(baker, some, threads, out.rays);
  const VectorXd metric = metric_of(out.transfer, matrices, bake.band_power);
  const Principal basis = find_principal(matrices, metric, bake);
  out.transfer.components = in_numbers(basis, metric);
  out.noise = noise_of(matrices, matrices_of({tracer, light, redrawn}, some, threads, out.rays), metric);

  const std::size_t rank = out.transfer.rank();
  out.transfer.weights.resize(vertices.size() * rank);
  std::vector<double> left(vertices.size());
  const Projector projector(baker, basis, metric);
  std::atomic<std::uint64_t> rays = 0;
  for (std::size_t first = 0; first < points.size(); first += kNews) {
    const std::size_t count = std::min(kNews, points.size() - first);
    threads.for_blocks(count, kBlock, [&](std::size_t begin, std::size_t end) {
      const std::size_t n = first + begin;
      rays += projector.project(std::span(points).subspan(n, end - begin), &out.transfer.weights[n * rank], &left[n]);
    });
    if (bake.progress) bake.progress(first + count, points.size());
  }
  out.rays += rays;
  double squared = 0;
  for (std::size_t n = 0; n < left.size(); ++n) squared += share[n] * left[n];
  out.left_out = std::sqrt(squared);
  return out;
}

}  // namespace kiln
