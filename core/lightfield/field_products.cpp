#include "core/lightfield/field_products.h"

#include <algorithm>
#include <array>
#include <numbers>

#include "core/base/expects.h"

namespace kiln {
namespace {

constexpr double kSquaredY00 = 0.25 * std::numbers::inv_pi;

/// Four sums side by side.
double dot_of(std::span<const float> a, std::span<const float> b) {
  std::array<double, 4> sum{};
  const std::size_t whole = a.size() / 4 * 4;
  for (std::size_t at = 0; at < whole; at += 4)
    for (std::size_t lane = 0; lane < 4; ++lane) sum[lane] += double{a[at + lane]} * b[at + lane];
  for (std::size_t at = whole; at < a.size(); ++at) sum[0] += double{a[at]} * b[at];
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

double product(std::span<const float> a, std::span<const float> b, std::size_t noise) {
  const std::size_t told = a.size() - noise;
  return kSquaredY00 * (dot_of(a.first(told), b.first(told)) - dot_of(a.last(noise), b.last(noise)));
}

/// Coefficient k of column 3 i + c: channel c of the i-th other, minus that of v.
std::vector<double> columns_of(const LightField& field, std::uint32_t v, std::span<const std::uint32_t> others) {
  const std::size_t count = field.count(), columns = 3 * others.size();
  std::vector<double> out(count * columns);
  const std::vector<double> own = mean_light(field, v);
  for (std::size_t i = 0; i < others.size(); ++i) {
    const std::vector<double> other = mean_light(field, others[i]);
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t k = 0; k < count; ++k) out[k * columns + 3 * i + c] = other[c * count + k] - own[c * count + k];
  }
  return out;
}

std::vector<float> difference(std::span<const float> a, std::span<const float> b) {
  std::vector<float> out(a.size());
  std::ranges::transform(a, b, out.begin(), [](float x, float y) { return x - y; });
  return out;
}

}  // namespace

FieldProducts::FieldProducts(const LightField& field)
    : field_(field),
      norm_(field.degree),
      euclid_(field.degree == 0 && !field.has_sky() && !field.has_lamps() && !field.has_diffuse()) {
  EXPECTS(euclid_ ? field.noise < field.channels : field.channels == 3 && field.noise == 0);
}

void FieldProducts::of_differences(std::uint32_t v, std::span<const std::uint32_t> others, const Vec3d& n,
                                   std::vector<float>& products) const {
  if (!euclid_) {
    std::vector<double> columns = columns_of(field_, v, others);
    return norm_.products(n, others.size(), columns, products);
  }
  std::vector<std::vector<float>> rows;
  for (const std::uint32_t x : others) rows.push_back(difference(field_.of(x), field_.of(v)));
  products.clear();
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (std::size_t k = 0; k <= i; ++k)
      products.push_back(static_cast<float>(product(rows[i], rows[k], field_.noise)));
}

double FieldProducts::squared_norm(std::uint32_t v, const Vec3d& n) const {
  if (!euclid_) return kiln::squared_norm(norm_, n, mean_light(field_, v));
  const auto row = field_.of(v);
  return std::max(0.0, product(row, row, field_.noise));
}

double FieldProducts::squared_distance(std::uint32_t a, std::uint32_t b, const Vec3d& n) const {
  if (euclid_) {
    const std::vector<float> d = difference(field_.of(a), field_.of(b));
    return std::max(0.0, product(d, d, field_.noise));
  }
  std::vector<double> across = mean_light(field_, a);
  const std::vector<double> side = mean_light(field_, b);
  for (std::size_t i = 0; i < across.size(); ++i) across[i] -= side[i];
  return kiln::squared_norm(norm_, n, across);
}

}  // namespace kiln
