#include "core/prt/glossy_components.h"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/expects.h"

namespace kiln {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Matrices = Eigen::Map<const Eigen::MatrixXf>;  // one in each column

constexpr double kLeastLight = 0.01;  // of the light sent: where less arrives, errors are relative to this

/// Mean light that arrives; the first coefficient of a constant 1 is 2 sqrt(pi).
struct MeanLight {
  double sky = 0, lamps = 0;
};

MeanLight mean_light(const GlossyTransfer& shape, const Matrices& matrices) {
  const auto outputs = static_cast<std::size_t>(shape.outputs()), inputs = static_cast<std::size_t>(shape.inputs());
  const VectorXd mean = matrices.cast<double>().rowwise().mean().cwiseAbs();
  MeanLight out;
  for (std::size_t c = 0; c < static_cast<std::size_t>(shape.channels); ++c) {
    out.sky += mean[static_cast<Index>(c * outputs * inputs)] / shape.channels;
    if (shape.fixed) out.lamps += mean[static_cast<Index>(c * outputs * inputs + outputs)] / shape.channels;
  }
  out.sky = std::max(out.sky, kLeastLight);
  out.lamps /= 2 * std::sqrt(std::numbers::pi);
  return out;
}

/// Square roots of what the squared error of each number counts.
VectorXd metric_of(const GlossyTransfer& shape, const MeanLight& light, std::span<const double> band_power) {
  const auto outputs = static_cast<std::size_t>(shape.outputs()), inputs = static_cast<std::size_t>(shape.inputs());
  VectorXd out(static_cast<Index>(shape.stride()));
  for (std::size_t s = 0; s < shape.stride(); ++s) {
    const std::size_t i = s % inputs;
    const auto band = static_cast<std::size_t>(std::sqrt(static_cast<double>(i) + 0.5));
    const double per_direction = 1 / (4 * std::numbers::pi * shape.channels);
    const double squared = i < outputs       ? band_power[band] / (light.sky * light.sky)
                           : light.lamps > 0 ? 1 / (light.lamps * light.lamps)
                                             : 0;
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
Principal find_principal(const Matrices& matrices, const VectorXd& metric, const GlossyRank& asked) {
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
  while (rank < values.size() && rank < static_cast<Index>(asked.most) && left > asked.left_out * asked.left_out &&
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

}  // namespace

struct GlossyComponents::State {
  State(const GlossyTransfer& asked, const Matrices& matrices, const GlossyRank& rank)
      : shape(asked), light(mean_light(asked, matrices)), metric(metric_of(asked, light, rank.band_power)) {
    const Principal basis = find_principal(matrices, metric, rank);
    components = in_numbers(basis, metric);
    mean = basis.mean.cast<float>();
    scale = metric.cast<float>();
    units = basis.units.cast<float>();
  }

  Matrices matrices(std::span<const float> numbers) const {
    EXPECTS(!numbers.empty() && numbers.size() % shape.stride() == 0);
    return {numbers.data(), static_cast<Index>(shape.stride()), static_cast<Index>(numbers.size() / shape.stride())};
  }

  GlossyTransfer shape;
  MeanLight light;
  VectorXd metric;
  Components components;
  Eigen::VectorXf mean, scale;
  Eigen::MatrixXf units;
};

GlossyComponents::GlossyComponents(const GlossyTransfer& shape, std::span<const float> matrices,
                                   const GlossyRank& rank) {
  EXPECTS(!matrices.empty() && rank.band_power.size() == static_cast<std::size_t>(shape.order));
  const auto stride = static_cast<Index>(shape.stride());
  state_ = std::make_unique<State>(
      shape, Matrices(matrices.data(), stride, static_cast<Index>(matrices.size()) / stride), rank);
}

GlossyComponents::~GlossyComponents() = default;

std::size_t GlossyComponents::rank() const { return state_->components.rank(); }

Components GlossyComponents::components() const { return state_->components; }

void GlossyComponents::project(std::span<const float> matrices, float* weights, double* left) const {
  Eigen::MatrixXf block = state_->scale.asDiagonal() * (state_->matrices(matrices).colwise() - state_->mean);
  const Eigen::MatrixXf found = state_->units.transpose() * block;
  block -= state_->units * found;
  std::copy_n(found.data(), found.size(), weights);
  for (Index n = 0; n < block.cols(); ++n) left[n] = block.col(n).cast<double>().squaredNorm();
}

double GlossyComponents::noise(std::span<const float> a, std::span<const float> b) const {
  const Matrices first = state_->matrices(a), second = state_->matrices(b);
  const MatrixXd difference = state_->metric.asDiagonal() * (second - first).cast<double>();
  return std::sqrt(difference.squaredNorm() / (2.0 * static_cast<double>(first.cols())));
}

float GlossyComponents::norm1(std::span<const float> weights) const {
  const auto stride = static_cast<Index>(state_->shape.stride());
  const Matrices rows(state_->components.row(0), stride, static_cast<Index>(rank()));
  const Eigen::Map<const Eigen::VectorXf> w(weights.data(), static_cast<Index>(rank()));
  const Eigen::VectorXf matrix = rows * w;
  const Index outputs = state_->shape.outputs(), inputs = state_->shape.inputs();
  const auto lamps = static_cast<float>(2 * std::sqrt(std::numbers::pi) * state_->light.lamps);
  float largest = 0;
  for (Index c = 0; c < state_->shape.channels; ++c) {
    // A row for each input: numbers lie by output, then input.
    const Eigen::Map<const Eigen::MatrixXf> numbers(matrix.data() + c * outputs * inputs, inputs, outputs);
    const Eigen::VectorXf sums = numbers.cwiseAbs().rowwise().sum();
    largest = std::max(largest, sums.head(outputs).maxCoeff() / static_cast<float>(state_->light.sky));
    if (inputs > outputs && lamps > 0) largest = std::max(largest, sums[outputs] / lamps);
  }
  return largest;
}

}  // namespace kiln
