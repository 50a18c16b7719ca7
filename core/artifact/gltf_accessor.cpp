#include "core/artifact/gltf_accessor.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "core/artifact/gltf_check.h"

namespace kiln::gltf {
namespace {

template <class T>
T load(const std::uint8_t* at) {
  static_assert(std::endian::native == std::endian::little, "glTF is little-endian");
  T x;
  std::memcpy(&x, at, sizeof x);
  return x;
}

std::uint32_t load_unsigned(const std::uint8_t* at, Component c) {
  return c == Component::u8 ? *at : c == Component::u16 ? load<std::uint16_t>(at) : load<std::uint32_t>(at);
}

/// glTF 2.0, 3.11: f = c / 255, max(c / 127, -1) and so on.
float load_float(const std::uint8_t* at, Component c, bool normalized) {
  switch (c) {
    case Component::i8: {
      const auto x = static_cast<float>(load<std::int8_t>(at));
      return normalized ? std::max(x / 127.0F, -1.0F) : x;
    }
    case Component::u8:
      return static_cast<float>(*at) / (normalized ? 255.0F : 1.0F);
    case Component::i16: {
      const auto x = static_cast<float>(load<std::int16_t>(at));
      return normalized ? std::max(x / 32767.0F, -1.0F) : x;
    }
    case Component::u16:
      return static_cast<float>(load<std::uint16_t>(at)) / (normalized ? 65535.0F : 1.0F);
    case Component::u32:
      return static_cast<float>(load<std::uint32_t>(at));
    case Component::f32:
      return load<float>(at);
  }
  return 0;
}

/// Calls put(element, component, bytes) for all that the views hold, then for the sparse replacements.
template <class Put>
void for_each_component(const AccessorSource& source, const Accessor& a, const std::string& place, Findings& findings,
                        const Put& put) {
  const std::uint64_t size = component_bytes(a.component);
  const auto element = [&](std::uint64_t i, const std::uint8_t* at) {
    for (std::uint64_t c = 0; c < a.width; ++c) put(i, c, at + c * size);
  };
  if (a.view >= 0) {
    const std::uint8_t* base = source.bytes.views[static_cast<std::size_t>(a.view)].data() + a.offset;
    const std::uint64_t stride = stride_of(a, source.document);
    for (std::uint64_t i = 0; i < a.count; ++i) element(i, base + i * stride);
  }
  if (a.sparse.count == 0) return;
  const Sparse& s = a.sparse;
  const std::uint8_t* indices = source.bytes.views[static_cast<std::size_t>(s.index_view)].data() + s.index_offset;
  const std::uint8_t* values = source.bytes.views[static_cast<std::size_t>(s.value_view)].data() + s.value_offset;
  for (std::uint64_t i = 0; i < s.count; ++i) {
    const std::uint32_t at = load_unsigned(indices + i * component_bytes(s.index_component), s.index_component);
    if (at >= a.count) {
      return findings.fail("accessor_sparse_index", std::to_string(at) + " >= " + std::to_string(a.count) + ".",
                           place + " sparse element " + std::to_string(i));
    }
    element(at, values + i * a.element_bytes());
  }
}

const Accessor& at(const AccessorSource& source, int i) {
  return source.document.accessors[static_cast<std::size_t>(i)];
}

}  // namespace

std::vector<float> read_floats(const AccessorSource& source, int accessor, const std::string& place,
                               Findings& findings) {
  const Accessor& a = at(source, accessor);
  if (a.matrix) {
    findings.fail("accessor_type", "Matrices are not expected here.", place);
    return {};
  }
  std::vector<float> out(a.count * a.width);
  for_each_component(source, a, place, findings, [&](std::uint64_t i, std::uint64_t c, const std::uint8_t* bytes) {
    out[i * a.width + c] = load_float(bytes, a.component, a.normalized);
  });
  const auto bad = std::find_if(out.begin(), out.end(), [](float x) { return !std::isfinite(x); });
  if (bad != out.end()) {
    const auto element = static_cast<std::uint64_t>(bad - out.begin()) / a.width;
    findings.fail("non_finite_geometry", std::isnan(*bad) ? "A value is not a number." : "A value is infinite.",
                  place + " element " + std::to_string(element));
  }
  return out;
}

std::vector<std::uint32_t> read_indices(const AccessorSource& source, int accessor, const std::string& place,
                                        Findings& findings) {
  const Accessor& a = at(source, accessor);
  std::vector<std::uint32_t> out(a.count);
  for_each_component(source, a, place, findings, [&](std::uint64_t i, std::uint64_t, const std::uint8_t* bytes) {
    out[i] = load_unsigned(bytes, a.component);
  });
  return out;
}

AccessorReader::AccessorReader(const AccessorSource& source, int accessor, const std::string& place, Findings& findings)
    : count_(at(source, accessor).count), width_(at(source, accessor).width) {
  const Accessor& a = at(source, accessor);
  if (a.matrix) findings.fail("accessor_type", "Matrices are not expected here.", place);
  if (a.matrix) return;
  if (a.view < 0 || a.sparse.count > 0) {
    if (a.width == 1) held_indices_ = read_indices(source, accessor, place, findings);
    held_ = read_floats(source, accessor, place, findings);
    return;
  }
  base_ = source.bytes.views[static_cast<std::size_t>(a.view)].data() + a.offset;
  stride_ = stride_of(a, source.document);
  component_ = a.component;
  normalized_ = a.normalized;
}

void AccessorReader::floats(std::uint64_t element, float* out) const {
  if (!base_) {
    std::copy_n(held_.begin() + static_cast<std::ptrdiff_t>(element * width_), width_, out);
    return;
  }
  const std::uint8_t* from = base_ + element * stride_;
  const std::uint64_t size = component_bytes(component_);
  for (std::uint64_t c = 0; c < width_; ++c) out[c] = load_float(from + c * size, component_, normalized_);
}

std::uint32_t AccessorReader::index(std::uint64_t element) const {
  return base_ ? load_unsigned(base_ + element * stride_, component_) : held_indices_[element];
}

const std::uint8_t* AccessorReader::address(std::uint64_t element) const {
  return base_ ? base_ + element * stride_ : nullptr;
}

}  // namespace kiln::gltf
