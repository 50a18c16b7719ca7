#include "core/bake/error_stats.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/base/expects.h"
#include "core/base/random.h"

namespace kiln {
namespace {

constexpr double kMaxAdditions = 2e8;  // of one bootstrap: about a second

Vec3d absolute(const Vec3d& a) { return {std::abs(a.x), std::abs(a.y), std::abs(a.z)}; }
double mean_channel(const Vec3d& a) { return (a.x + a.y + a.z) / 3; }

/// What a point contributes to one lighting: means over RGB times its weight, not yet divided by the lighting's scale.
struct Cell {
  double squared = 0;  // (x - ref)^2 - noise
  double size = 0;     // |ref|, or |x| where the lighting is dark; of_rms: ref^2 - noise, or x^2
};

struct Table {
  std::size_t points = 0, lightings = 0;
  std::vector<Cell> cells;     // lighting * points + point
  std::vector<bool> dark;      // lightings without any light in reference and values
  std::vector<double> weight;  // of the points
  bool of_rms = false;
};

double sum_of_sizes(std::span<const Vec3d> values) {
  return std::accumulate(values.begin(), values.end(), 0.0,
                         [](double sum, const Vec3d& v) { return sum + mean_channel(absolute(v)); });
}

Table make_table(const ErrorInput& in) {
  Table table{in.points, in.values.size() / in.points, std::vector<Cell>(in.values.size()), {}, {}, in.of_rms};
  table.weight.assign(in.points, 1.0);
  if (!in.weights.empty()) table.weight.assign(in.weights.begin(), in.weights.end());
  for (std::size_t lighting = 0; lighting < table.lightings; ++lighting) {
    const std::size_t first = lighting * in.points;
    const bool lit = sum_of_sizes(in.reference.subspan(first, in.points)) > 0;
    const auto sizes = lit ? in.reference : in.values;
    table.dark.push_back(!lit && !(sum_of_sizes(in.values.subspan(first, in.points)) > 0));
    for (std::size_t i = first; i < first + in.points; ++i) {
      const Vec3d difference = in.values[i] - in.reference[i];
      const double noise = in.noise.empty() ? 0.0 : mean_channel(in.noise[i]);
      const double weight = table.weight[i - first];
      const double size =
          in.of_rms ? mean_channel(sizes[i] * sizes[i]) - (lit ? noise : 0) : mean_channel(absolute(sizes[i]));
      table.cells[i] = {weight * (mean_channel(difference * difference) - noise), weight * size};
    }
  }
  return table;
}

/// Sums over points of one lighting, n their weight: the square of what its error is relative to.
double squared_scale(const Table& table, const Cell& sum, double n) {
  const double mean = sum.size / n;
  return table.of_rms ? mean : mean * mean;
}

/// relRMSE^2 of one lighting.
double squared_error(const Table& table, const Cell& sum, double n) {
  if (table.of_rms) return sum.size > 0 ? sum.squared / sum.size : 0.0;
  return sum.size > 0 ? sum.squared * n / (sum.size * sum.size) : 0.0;
}

double to_error(double mean_squared) { return std::sqrt(std::max(mean_squared, 0.0)); }

double weight_of(const Table& table, std::span<const std::uint32_t> points) {
  double sum = 0;
  for (const std::uint32_t point : points) sum += table.weight[point];
  return sum;
}

double weight_of(const Table& table) { return std::accumulate(table.weight.begin(), table.weight.end(), 0.0); }

std::vector<Cell> sums_over(const Table& table, std::span<const std::uint32_t> points) {
  std::vector<Cell> sums(table.lightings);
  for (std::size_t lighting = 0; lighting < table.lightings; ++lighting) {
    Cell sum;
    const Cell* cells = table.cells.data() + lighting * table.points;
    for (const std::uint32_t point : points) {
      sum.squared += cells[point].squared;
      sum.size += cells[point].size;
    }
    sums[lighting] = sum;
  }
  return sums;
}

/// Mean of relRMSE^2 over lightings. Signed: near zero the noise may have taken more than there was.
double mean_squared_error(const Table& table, const std::vector<Cell>& sums, double n) {
  double mean = 0;
  for (const Cell& sum : sums) mean += squared_error(table, sum, n);
  return mean / static_cast<double>(sums.size());
}

std::vector<std::uint32_t> all_points(const Table& table) {
  std::vector<std::uint32_t> points(table.points);
  std::iota(points.begin(), points.end(), 0U);
  return points;
}

double normal_distribution(double x) { return 0.5 * std::erfc(-x / std::sqrt(2.0)); }

/// Inverse of the normal distribution by bisection, within 1e-12.
double normal_quantile(double p) {
  double low = -8, high = 8;
  while (high - low > 1e-12) {
    const double middle = (low + high) / 2;
    (normal_distribution(middle) < p ? low : high) = middle;
  }
  return (low + high) / 2;
}

/// Acceleration of the BCa interval from the jackknife: how the statistic's spread grows with its value.
double acceleration(const Table& table, const std::vector<Cell>& sums) {
  std::vector<double> without(table.points);
  std::vector<Cell> rest(table.lightings);
  const double n = weight_of(table);
  for (std::size_t point = 0; point < table.points; ++point) {
    for (std::size_t lighting = 0; lighting < table.lightings; ++lighting) {
      const Cell& cell = table.cells[lighting * table.points + point];
      rest[lighting] = {sums[lighting].squared - cell.squared, sums[lighting].size - cell.size};
    }
    without[point] = mean_squared_error(table, rest, n - table.weight[point]);
  }
  const double mean = std::accumulate(without.begin(), without.end(), 0.0) / static_cast<double>(without.size());
  double second = 0, third = 0;
  for (const double value : without) {
    second += (mean - value) * (mean - value);
    third += (mean - value) * (mean - value) * (mean - value);
  }
  return second > 0 ? third / (6 * std::pow(second, 1.5)) : 0.0;
}

std::vector<double> resampled_errors(const Table& table, const Bootstrap& bootstrap) {
  const double cost = static_cast<double>(table.cells.size());
  const int affordable = static_cast<int>(std::max(200.0, std::min(kMaxAdditions / cost, 1e6)));
  std::vector<double> errors(static_cast<std::size_t>(std::max(1, std::min(bootstrap.resamples, affordable))));
  std::vector<std::uint32_t> drawn(table.points);
  for (std::size_t sample = 0; sample < errors.size(); ++sample) {
    Random random(bootstrap.seed, 0x626f6f74, sample);
    for (std::uint32_t& point : drawn) {
      point = static_cast<std::uint32_t>(random.uniform_double() * static_cast<double>(table.points));
    }
    errors[sample] = mean_squared_error(table, sums_over(table, drawn), weight_of(table, drawn));
  }
  std::sort(errors.begin(), errors.end());
  return errors;
}

double quantile(const std::vector<double>& sorted, double p) {
  const double place = std::clamp(p, 0.0, 1.0) * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const auto above = std::min(below + 1, sorted.size() - 1);
  const double part = place - static_cast<double>(below);
  return sorted[below] * (1 - part) + sorted[above] * part;
}

struct Deviation {
  double size, weight;
};

/// The size below which the share `p` of the weight lies.
double quantile(const std::vector<Deviation>& sorted, double p) {
  double all = 0, below = 0;
  for (const Deviation& d : sorted) all += d.weight;
  for (const Deviation& d : sorted) {
    below += d.weight;
    if (below >= p * all) return d.size;
  }
  return sorted.back().size;
}

/// [Efron87]: percentiles of the resampled figure, moved for its bias (z0) and its changing spread (a).
void add_interval(const Table& table, const std::vector<Cell>& sums, const Bootstrap& bootstrap, ErrorStats& stats) {
  const double squared = mean_squared_error(table, sums, weight_of(table));
  stats.interval_low = stats.interval_high = to_error(squared);
  if (table.points < 2) return;
  const std::vector<double> errors = resampled_errors(table, bootstrap);
  if (errors.front() == errors.back()) return;  // every resample agrees: nothing to correct
  const double count = static_cast<double>(errors.size());
  const auto less = std::lower_bound(errors.begin(), errors.end(), squared) - errors.begin();
  const auto not_more = std::upper_bound(errors.begin(), errors.end(), squared) - errors.begin();
  const double below = 0.5 * static_cast<double>(less + not_more) / count;
  const double z0 = normal_quantile(std::clamp(below, 0.5 / count, 1 - 0.5 / count));
  const double a = acceleration(table, sums);
  const auto end = [&](double p) {
    const double z = z0 + normal_quantile(p);
    return to_error(quantile(errors, normal_distribution(z0 + z / std::max(1 - a * z, 1e-3))));
  };
  stats.interval_low = end(0.025);
  stats.interval_high = end(0.975);
}

/// relRMSE of the points that are left when the worst hundredth (rounded up, never all) is taken out.
double without_worst(const Table& table, const std::vector<Cell>& sums) {
  const double n = weight_of(table);
  std::vector<double> share(table.points);
  for (std::size_t i = 0; i < table.cells.size(); ++i) {
    const double scale = squared_scale(table, sums[i / table.points], n);
    const std::size_t point = i % table.points;
    if (scale > 0) share[point] += table.cells[i].squared / table.weight[point] / (n * scale);
  }
  std::vector<std::uint32_t> points = all_points(table);
  std::stable_sort(points.begin(), points.end(), [&](auto a, auto b) { return share[a] < share[b]; });
  for (double left_out = 0; points.size() > 1 && left_out < 0.01 * n; points.pop_back())
    left_out += table.weight[points.back()];
  std::sort(points.begin(), points.end());
  return to_error(mean_squared_error(table, sums_over(table, points), weight_of(table, points)));
}

/// Figures over single channels: p99, max, bias, and the noise that was subtracted.
void add_channel_figures(const ErrorInput& in, const Table& table, const std::vector<Cell>& sums, ErrorStats& stats) {
  std::vector<Deviation> deviations;
  deviations.reserve(3 * in.values.size());
  double signed_sum = 0, noise_sum = 0;
  const double n = weight_of(table);
  for (std::size_t i = 0; i < in.values.size(); ++i) {
    const double size = squared_scale(table, sums[i / in.points], n), weight = table.weight[i % in.points];
    const double scale = size > 0 ? 1 / std::sqrt(size) : 0;
    const Vec3d difference = (in.values[i] - in.reference[i]) * scale;
    signed_sum += weight * mean_channel(difference);
    if (!in.noise.empty()) noise_sum += weight * mean_channel(in.noise[i]) * scale * scale;
    for (std::size_t c = 0; c < 3; ++c) deviations.push_back({std::abs(difference[c]), weight});
  }
  std::ranges::sort(deviations, {}, &Deviation::size);
  stats.p99 = quantile(deviations, 0.99);
  stats.max = deviations.back().size;
  const double all = n * static_cast<double>(table.lightings);
  stats.bias = signed_sum / all;
  stats.noise = std::sqrt(noise_sum / all);
}

}  // namespace

ErrorStats compute_error(const ErrorInput& in, const Bootstrap& bootstrap) {
  EXPECTS(in.values.size() == in.reference.size());
  EXPECTS(in.noise.empty() || in.noise.size() == in.values.size());
  EXPECTS(in.points > 0 ? in.values.size() % in.points == 0 : in.values.empty());
  EXPECTS(in.weights.empty() || in.weights.size() == in.points);
  ErrorStats stats;
  if (in.values.empty()) return stats;
  const Table table = make_table(in);
  const std::vector<Cell> sums = sums_over(table, all_points(table));
  stats.points = table.points;
  stats.lightings = static_cast<int>(table.lightings);
  stats.dark_lightings = static_cast<int>(std::count(table.dark.begin(), table.dark.end(), true));
  stats.relrmse = to_error(mean_squared_error(table, sums, weight_of(table)));
  for (const Cell& sum : sums) {
    stats.by_lighting.push_back(to_error(squared_error(table, sum, weight_of(table))));
  }
  stats.relrmse_without_worst_1pct = without_worst(table, sums);
  add_channel_figures(in, table, sums, stats);
  add_interval(table, sums, bootstrap, stats);
  return stats;
}

std::vector<Vec3d> noise_from_halves(std::span<const Vec3d> half_a, std::span<const Vec3d> half_b) {
  EXPECTS(half_a.size() == half_b.size());
  std::vector<Vec3d> noise(half_a.size());
  for (std::size_t i = 0; i < noise.size(); ++i) {
    const Vec3d half_difference = (half_a[i] - half_b[i]) * 0.5;
    noise[i] = half_difference * half_difference;
  }
  return noise;
}

}  // namespace kiln
