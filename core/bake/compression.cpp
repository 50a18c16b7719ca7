#include "core/bake/compression.h"

#include <algorithm>
#include <cmath>

#include "core/artifact/baked_geometry.h"
#include "core/artifact/stored_transfer.h"
#include "core/bake/lightings.h"
#include "core/mesh/topology.h"

namespace kiln {
namespace {

/// The fewest components that leave no more than `allowed`.
std::size_t rank_for(const ComponentAnalysis& analysis, double allowed) {
  const auto found = std::ranges::find_if(analysis.left_out, [&](double left) { return left <= allowed; });
  return std::max<std::size_t>(1, static_cast<std::size_t>(found - analysis.left_out.begin()));
}

/// Bits of a vertex before entropy coding.
double stored_bits(const BakedScene& baked, const TransferEncoding& encoding) {
  const StoredTransfer stored(baked.transfer, encoding, used_vertices(baked.scene.mesh));
  double sum = 0;
  for (std::size_t j = 0; j < stored.form().count(); ++j) sum += stored.form().scale[j] > 0 ? stored.bits(j / 4) : 0;
  return sum;
}

/// Mean light of the lamps over the surface.
double mean_lamp_light(const BakedScene& baked) {
  const Transfer& t = baked.transfer;
  double sum = 0, area = 0;
  for (const Triangle& triangle : baked.scene.mesh.triangles) {
    const double a = triangle_area(baked.scene.mesh, triangle);
    area += a;
    for (const std::uint32_t v : triangle) {
      for (int c = 0; c < t.channels; ++c) sum += a * std::abs(t.at(v, c)[t.slots() - 1]) / (3 * t.channels);
    }
  }
  return area > 0 ? sum / area : 0;
}

/// Rounding to steps of s adds s^2 / 12 to the squared error.
double step_for(double error) { return error * std::sqrt(12.0); }

Compression components(const BakedScene& baked, const Plan& plan) {
  const double share = plan.compression / std::sqrt(2.0);
  const ComponentAnalysis analysis =
      analyse_components(baked.transfer, baked.scene.mesh, band_power(baked.transfer.order, baked.light));
  const std::size_t most = analysis.components.rank();
  const std::size_t rank =
      plan.encoding.rank ? std::min(most, static_cast<std::size_t>(*plan.encoding.rank)) : rank_for(analysis, share);
  Compression out;
  out.left_out = analysis.left_out[rank];
  out.encoding = {.bits = plan.encoding.bits.value_or(plan.raw_bits),
                  .components = analysis.first(rank),
                  .weights = analysis.weights(baked.transfer, rank)};
  if (!plan.encoding.bits) out.encoding.weight_step = step_for(share / std::sqrt(static_cast<double>(rank)));
  return out;
}

/// Appends b - a in RGB.
void append_difference(const Transfer& shape, const float* a, const float* b, std::vector<float>& out) {
  for (int c = 0; c < 3; ++c) {
    const int first = shape.channels == 1 ? 0 : c * shape.slots();
    for (int i = first; i < first + shape.slots(); ++i) out.push_back(b[i] - a[i]);
  }
}

}  // namespace

StorageProbes probe_storage(const BakedScene& baked, const TransferEncoding& encoding,
                            std::span<const std::uint32_t> vertices) {
  StorageProbes out;
  out.left_out.vertices = out.rounding.vertices = {vertices.begin(), vertices.end()};
  const StoredTransfer stored(baked.transfer, encoding, used_vertices(baked.scene.mesh));
  for (const auto v : vertices) {
    const auto exact = stored.read_back(v, false), rounded = stored.read_back(v, true);
    append_difference(baked.transfer, baked.transfer.at(v, 0), exact.data(), out.left_out.difference);
    append_difference(baked.transfer, exact.data(), rounded.data(), out.rounding.difference);
  }
  return out;
}

Compression choose_encoding(const BakedScene& baked, const Plan& plan) {
  using Form = PrtStep::Encoding::Form;
  double lamp_step = 0;
  if (baked.transfer.fixed && !plan.encoding.bits)
    lamp_step = step_for(plan.compression / std::sqrt(2.0) * mean_lamp_light(baked));
  Compression raw{{.bits = plan.encoding.bits.value_or(plan.raw_bits), .lamp_step = lamp_step}};
  if (plan.encoding.form == Form::raw || baked.transfer.order == 0) return raw;
  Compression fewer = components(baked, plan);
  fewer.encoding.lamp_step = lamp_step;
  if (plan.encoding.form == Form::components || plan.encoding.rank) return fewer;
  return stored_bits(baked, fewer.encoding) < stored_bits(baked, raw.encoding) ? fewer : raw;
}

}  // namespace kiln
