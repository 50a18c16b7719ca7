#include "core/artifact/stored_transfer.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/expects.h"

namespace kiln {
namespace {

constexpr int kFewestBits = 2, kMostBits = 20;

std::size_t lamp_numbers(const Transfer& shape) { return shape.fixed ? static_cast<std::size_t>(shape.channels) : 0; }

std::size_t lamp_slot(const Transfer& shape, std::size_t channel) {
  return (channel + 1) * static_cast<std::size_t>(shape.slots()) - 1;
}

/// The weights and, behind them, the lamps' light of each vertex.
std::vector<float> weights_and_lamps(const Transfer& transfer, const TransferEncoding& encoding) {
  const std::size_t rank = encoding.components.rank(), lamps = lamp_numbers(transfer);
  EXPECTS(encoding.weights.size() == rank * transfer.vertices());
  if (lamps == 0) return encoding.weights;
  std::vector<float> out((rank + lamps) * transfer.vertices());
  for (std::size_t v = 0; v < transfer.vertices(); ++v) {
    float* to = &out[v * (rank + lamps)];
    std::copy_n(&encoding.weights[v * rank], rank, to);
    for (std::size_t c = 0; c < lamps; ++c) to[rank + c] = transfer.at(v, 0)[lamp_slot(transfer, c)];
  }
  return out;
}

}  // namespace

std::size_t StoredForm::expected_count(const Transfer& shape) const {
  return raw() ? shape.stride() : components.rank() + lamp_numbers(shape);
}

void slots_of(const StoredForm& form, const Transfer& shape, const float* numbers, float* slots) {
  const std::size_t stride = shape.stride();
  if (form.raw()) {
    std::copy_n(numbers, stride, slots);
    return;
  }
  const std::size_t rank = form.components.rank();
  for (std::size_t s = 0; s < stride; ++s) {
    double sum = form.components.mean()[s];
    for (std::size_t k = 0; k < rank; ++k) sum += static_cast<double>(numbers[k]) * form.components.row(k)[s];
    slots[s] = static_cast<float>(sum);
  }
  for (std::size_t c = 0; c < lamp_numbers(shape); ++c) slots[lamp_slot(shape, c)] = numbers[rank + c];
}

StoredTransfer::StoredTransfer(const Transfer& transfer, const TransferEncoding& encoding,
                               std::span<const std::uint32_t> vertices)
    : transfer_(transfer) {
  EXPECTS(!vertices.empty());
  form_.components = encoding.components;
  const std::size_t count = form_.expected_count(transfer);
  form_.scale.assign(count, 0.0);
  form_.offset.assign(count, 0.0);
  if (!form_.raw()) weights_ = weights_and_lamps(transfer, encoding);
  measure_ranges(vertices);
  choose_bits(encoding);
}

const float* StoredTransfer::numbers_of(std::size_t vertex) const {
  return form_.raw() ? transfer_.at(vertex, 0) : &weights_[vertex * form_.count()];
}

void StoredTransfer::measure_ranges(std::span<const std::uint32_t> vertices) {
  const std::size_t count = form_.count();
  std::vector<double> low(count, std::numeric_limits<double>::infinity());
  std::vector<double> high(count, -std::numeric_limits<double>::infinity());
  for (const auto v : vertices) {
    const float* numbers = numbers_of(v);
    for (std::size_t j = 0; j < count; ++j) {
      EXPECTS(std::isfinite(numbers[j]));
      low[j] = std::min<double>(low[j], numbers[j]);
      high[j] = std::max<double>(high[j], numbers[j]);
    }
  }
  for (std::size_t j = 0; j < count; ++j) {
    form_.scale[j] = (high[j] - low[j]) / 2;
    form_.offset[j] = low[j] + form_.scale[j];
  }
}

bool StoredTransfer::is_lamp(std::size_t number) const {
  if (!transfer_.fixed) return false;
  if (!form_.raw()) return number >= form_.components.rank();
  const auto slots = static_cast<std::size_t>(transfer_.slots());
  return number % slots == slots - 1;
}

/// As many levels as give weights steps of at most `weight_step` and lamps of at most `lamp_step`; `bits` where none is
/// asked for.
void StoredTransfer::choose_bits(const TransferEncoding& encoding) {
  const std::size_t rank = form_.raw() ? 0 : form_.components.rank();
  const auto bits_for = [](double half_range, double step) {
    const double bits = std::ceil(std::log2(2 * half_range / step + 1));
    return static_cast<int>(std::clamp<double>(bits, kFewestBits, kMostBits));
  };
  for (std::size_t k = 0; k < vec4s_of(form_.count()); ++k) {
    const std::size_t first = 4 * k, end = std::min(first + 4, form_.count()), weights = std::min(end, rank);
    int bits = kFewestBits;
    double widest = 0;
    for (std::size_t j = first; j < end; ++j) {
      const double step = is_lamp(j) ? encoding.lamp_step : j < rank ? encoding.weight_step : 0;
      bits = std::max(bits, step > 0 ? bits_for(form_.scale[j], step) : encoding.bits);
      if (j < rank) widest = std::max(widest, form_.scale[j]);
    }
    bits_.push_back(bits);
    for (std::size_t j = first; j < weights && encoding.weight_step > 0; ++j) {
      if (form_.scale[j] > 0) form_.scale[j] = widest;  // equal steps in all four
    }
  }
}

std::vector<float> StoredTransfer::pack(std::size_t k, std::span<const std::uint32_t> vertices) const {
  std::vector<float> out(vertices.size() * 4, 0.0F);
  const std::size_t end = std::min(4 * k + 4, form_.count());
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const float* numbers = numbers_of(vertices[i]);
    for (std::size_t j = 4 * k; j < end; ++j) {
      if (form_.scale[j] == 0) continue;
      const double stored = (numbers[j] - form_.offset[j]) / form_.scale[j];
      out[i * 4 + j - 4 * k] = static_cast<float>(std::clamp(stored, -1.0, 1.0));
    }
  }
  return out;
}

std::vector<float> StoredTransfer::read_back(std::size_t vertex, bool rounded) const {
  const float* exact = numbers_of(vertex);
  std::vector<float> numbers(exact, exact + form_.count()), slots(transfer_.stride());
  for (std::size_t j = 0; j < numbers.size() && rounded; ++j) {
    const double step = 2 * form_.scale[j] / (std::exp2(bits_[j / 4]) - 1), low = form_.offset[j] - form_.scale[j];
    if (step > 0) numbers[j] = static_cast<float>(low + step * std::round((numbers[j] - low) / step));
  }
  slots_of(form_, transfer_, numbers.data(), slots.data());
  return slots;
}

StoredGlossy::StoredGlossy(const GlossyTransfer& glossy, const Encoding& encoding,
                           std::span<const std::uint32_t> vertices)
    : glossy_(glossy), one_number_{1, 1, false, std::vector<float>(glossy.vertices.size(), 0.0F)} {
  EXPECTS(glossy.weights.size() == glossy.rank() * glossy.vertices.size());
  numbers_.emplace(one_number_,
                   TransferEncoding{.bits = encoding.transfer.bits,
                                    .components = glossy.components,
                                    .weights = glossy.weights,
                                    .weight_step = encoding.glossy_step},
                   places(vertices));
}

std::vector<std::uint32_t> StoredGlossy::places(std::span<const std::uint32_t> vertices) const {
  std::vector<std::uint32_t> out;
  for (const auto v : vertices) {
    if (has(v)) out.push_back(static_cast<std::uint32_t>(glossy_.find(v)));
  }
  return out;
}

std::vector<float> StoredGlossy::pack(std::size_t k, std::span<const std::uint32_t> vertices) const {
  const std::vector<std::uint32_t> rows = places(vertices);
  EXPECTS(rows.size() == vertices.size());
  return numbers_->pack(k, rows);
}

StoredField::StoredField(const LightField& field, const Encoding& encoding, std::span<const std::uint32_t> vertices)
    : shape_(field_shape(field.degree)),
      visibility_shape_(visibility_shape()),
      lamp_shape_(lamp_shape(field.lamps.size())) {
  shape_.coefficients = field.coefficients;
  numbers_.emplace(shape_, encoding.field, vertices);
  const TransferEncoding seen{.bits = encoding.visibility_bits};
  visibility_shape_.coefficients = field.visibility;
  lamp_shape_.coefficients = field.lamp_visibility;
  if (field.has_sky()) visibility_.emplace(visibility_shape_, seen, vertices);
  if (field.has_lamps()) lamps_.emplace(lamp_shape_, seen, vertices);
}

}  // namespace kiln
