#include "core/prt/components.h"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/base/expects.h"

namespace kiln {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t kBlock = 2048;  // vertices of one update of the covariance
constexpr double kLeastLight = 0.01;  // of the sky: where less arrives, errors are taken relative to this

/// A third of each triangle's area at its corners; all the same where the surface has none. They sum to 1.
VectorXd vertex_shares(const Mesh& mesh) {
  VectorXd share = VectorXd::Zero(static_cast<Eigen::Index>(mesh.position.size()));
  for (const Triangle& t : mesh.triangles) {
    const Vec3d a = to_double(mesh.position[t[0]]), b = to_double(mesh.position[t[1]]),
                c = to_double(mesh.position[t[2]]);
    for (const auto v : t) share[static_cast<Eigen::Index>(v)] += length(cross(b - a, c - a));
  }
  const double sum = share.sum();
  if (sum > 0) return share / sum;
  return VectorXd::Constant(share.size(), 1.0 / static_cast<double>(share.size()));
}

/// Slots that hold distant light: one in each row of the metric.
struct Slots {
  std::vector<std::size_t> at;  // flat slot
  VectorXd metric;              // square roots of what their squared error counts
};

double mean_value(const Transfer& transfer, const VectorXd& share) {
  double sum = 0;
  for (std::size_t v = 0; v < transfer.vertices(); ++v) {
    for (int c = 0; c < transfer.channels; ++c)
      sum += share[static_cast<Eigen::Index>(v)] * transfer.at(v, c)[0] / transfer.channels;
  }
  return std::abs(sum) * 2 * std::sqrt(M_PI);  // light of mean 1 has 2 sqrt(pi) in band 0
}

Slots distant_slots(const Transfer& transfer, double mean, std::span<const double> band_power) {
  const int count = sh_count(transfer.order);
  Slots out{{}, VectorXd(transfer.channels * count)};
  for (int c = 0; c < transfer.channels; ++c) {
    for (int i = 0; i < count; ++i) {
      const auto band = static_cast<std::size_t>(std::sqrt(static_cast<double>(i) + 0.5));
      out.metric[static_cast<Eigen::Index>(out.at.size())] = std::sqrt(band_power[band] / transfer.channels) / mean;
      out.at.push_back(static_cast<std::size_t>(c * transfer.slots() + i));
    }
  }
  return out;
}

/// Rows of vertices, in the metric.
MatrixXd scaled_rows(const Transfer& transfer, const Slots& slots, std::size_t first, std::size_t count) {
  MatrixXd out(static_cast<Eigen::Index>(slots.at.size()), static_cast<Eigen::Index>(count));
  for (std::size_t v = 0; v < count; ++v) {
    const float* t = transfer.at(first + v, 0);
    for (std::size_t s = 0; s < slots.at.size(); ++s) {
      const auto row = static_cast<Eigen::Index>(s);
      out(row, static_cast<Eigen::Index>(v)) = slots.metric[row] * t[slots.at[s]];
    }
  }
  return out;
}

/// f(first vertex, its rows) for each block.
template <class F>
void for_blocks(const Transfer& transfer, const Slots& slots, const F& f) {
  for (std::size_t first = 0; first < transfer.vertices(); first += kBlock)
    f(static_cast<Eigen::Index>(first),
      scaled_rows(transfer, slots, first, std::min(kBlock, transfer.vertices() - first)));
}

VectorXd mean_of(const Transfer& transfer, const Slots& slots, const VectorXd& share) {
  VectorXd mean = VectorXd::Zero(slots.metric.size());
  for_blocks(transfer, slots,
             [&](Eigen::Index first, const MatrixXd& rows) { mean += rows * share.segment(first, rows.cols()); });
  return mean;
}

MatrixXd covariance_of(const Transfer& transfer, const Slots& slots, const VectorXd& share, const VectorXd& mean) {
  MatrixXd out = MatrixXd::Zero(mean.size(), mean.size());
  for_blocks(transfer, slots, [&](Eigen::Index first, MatrixXd rows) {
    rows.colwise() -= mean;
    out.selfadjointView<Eigen::Lower>().rankUpdate(rows * share.segment(first, rows.cols()).cwiseSqrt().asDiagonal());
  });
  return out;
}

/// From the metric back to flat slots. Eigenvalues ascend; components go by falling share.
ComponentAnalysis in_slots(const Slots& slots, std::size_t stride, const VectorXd& mean, const VectorXd& eigenvalues,
                           const MatrixXd& eigenvectors) {
  const std::size_t rank = slots.at.size();
  ComponentAnalysis out{{stride, std::vector<float>((rank + 1) * stride, 0.0F)},
                        std::vector<double>(rank + 1, 0.0),
                        std::vector<double>(rank * stride, 0.0)};
  for (std::size_t s = 0; s < rank; ++s) {
    const auto row = static_cast<Eigen::Index>(s);
    out.components.rows[slots.at[s]] = static_cast<float>(mean[row] / slots.metric[row]);
    for (std::size_t k = 0; k < rank; ++k) {
      const double u = eigenvectors(row, static_cast<Eigen::Index>(rank - 1 - k));
      out.components.rows[(k + 1) * stride + slots.at[s]] = static_cast<float>(u / slots.metric[row]);
      out.duals[k * stride + slots.at[s]] = u * slots.metric[row];
    }
  }
  double squared = 0;
  for (std::size_t k = rank; k-- > 0;) {
    squared += std::max(0.0, eigenvalues[static_cast<Eigen::Index>(rank - 1 - k)]);
    out.left_out[k] = std::sqrt(squared);
  }
  return out;
}

}  // namespace

Components ComponentAnalysis::first(std::size_t rank) const {
  EXPECTS(rank <= components.rank());
  const auto end = components.rows.begin() + static_cast<std::ptrdiff_t>((rank + 1) * components.stride);
  return {components.stride, {components.rows.begin(), end}};
}

std::vector<float> ComponentAnalysis::weights(const Transfer& transfer, std::size_t rank) const {
  EXPECTS(rank <= components.rank() && transfer.stride() == components.stride);
  const auto stride = static_cast<Eigen::Index>(components.stride), count = static_cast<Eigen::Index>(rank);
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const Eigen::Map<const Rows> dual(duals.data(), count, stride);
  const VectorXd mean = Eigen::Map<const Eigen::VectorXf>(components.mean(), stride).cast<double>();
  std::vector<float> out(transfer.vertices() * rank);
  for (std::size_t first = 0; first < transfer.vertices(); first += kBlock) {
    const auto block = static_cast<Eigen::Index>(std::min(kBlock, transfer.vertices() - first));
    const MatrixXd rows = Eigen::Map<const Eigen::MatrixXf>(transfer.at(first, 0), stride, block).cast<double>();
    Eigen::Map<Eigen::MatrixXf>(out.data() + first * rank, count, block) =
        (dual * (rows.colwise() - mean)).cast<float>();
  }
  return out;
}

ComponentAnalysis analyse_components(const Transfer& transfer, const Mesh& mesh, std::span<const double> band_power) {
  EXPECTS(transfer.vertices() == mesh.position.size() && transfer.vertices() > 0);
  EXPECTS(band_power.size() == static_cast<std::size_t>(transfer.order));
  EXPECTS(std::ranges::all_of(band_power, [](double p) { return p > 0; }));
  const VectorXd share = vertex_shares(mesh);
  const double light = mean_value(transfer, share);
  const Slots slots = distant_slots(transfer, std::max(light, kLeastLight), band_power);
  const VectorXd mean = mean_of(transfer, slots, share);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solved(covariance_of(transfer, slots, share, mean));
  EXPECTS(solved.info() == Eigen::Success);
  return in_slots(slots, transfer.stride(), mean, solved.eigenvalues(), solved.eigenvectors());
}

}  // namespace kiln
