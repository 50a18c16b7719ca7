#include "core/artifact/gltf_primitive.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string_view>

namespace kiln::gltf {
namespace {

std::uint64_t triangle_count(Mode mode, std::uint64_t corners) {
  return mode == Mode::triangles ? corners / 3 : corners < 3 ? 0 : corners - 2;
}

const Accessor& accessor(const Document& d, int i) { return d.accessors[static_cast<std::size_t>(i)]; }

/// Core component types, and those of KHR_mesh_quantization with a warning where it is not declared.
void check_component(const Document& d, const std::string& name, const Accessor& a, const std::string& place,
                     Findings& findings) {
  if (a.component == Component::f32) return;
  const bool color = name == "COLOR_0", uv = name.substr(0, 9) == "TEXCOORD_";
  const bool is_unsigned = a.component == Component::u8 || a.component == Component::u16;
  if (a.component == Component::u32 || (color && !(is_unsigned && a.normalized))) {
    return findings.fail("accessor_type", "The component type does not fit the attribute.", place);
  }
  const bool core = color || (uv && is_unsigned && a.normalized);
  if (!core && !d.declares_quantization) {
    findings.warn("quantization_not_declared", "Integer components need KHR_mesh_quantization, which is not declared.",
                  place);
  }
}

/// min and max are only a hint to Kiln, yet a file whose bounds lie is worth a word.
void check_bounds(const Accessor& a, const RawPart& part, const std::string& place, Findings& findings) {
  if (a.component != Component::f32 || a.min.size() != 3 || a.max.size() != 3) return;
  for (const Vec3f& p : part.position) {
    for (std::size_t i = 0; i < 3; ++i) {
      const double slack = 1e-5 * std::max({std::abs(a.min[i]), std::abs(a.max[i]), 1e-30});
      if (p[i] >= a.min[i] - slack && p[i] <= a.max[i] + slack) continue;
      return findings.warn("accessor_bounds_mismatch", "Values lie outside of the min and max of their accessor.",
                           place);
    }
  }
}

void read_attributes(const AccessorSource& source, const Primitive& primitive, RawPart& part, Findings& findings) {
  for (const char* name : kAttributes) {
    const int index = primitive.attribute(name);
    if (index < 0 || findings.failed() || primitive.draco.attributes.contains(name)) continue;
    const std::string place = part.place + "/attributes/" + name;
    const Accessor& a = accessor(source.document, index);
    check_component(source.document, name, a, place, findings);
    if (!findings.failed())
      set_attribute(part, name, read_floats(source, index, place, findings), a.width, place, findings);
    if (!findings.failed() && std::string_view(name) == "POSITION") check_bounds(a, part, place, findings);
  }
}

std::vector<std::uint32_t> read_corners(const AccessorSource& source, const Primitive& primitive, const RawPart& part,
                                        Findings& findings) {
  if (primitive.indices < 0) {
    std::vector<std::uint32_t> corners(part.position.size());
    std::iota(corners.begin(), corners.end(), 0U);
    return corners;
  }
  const std::string place = part.place + "/indices";
  auto corners = read_indices(source, primitive.indices, place, findings);
  const auto bad =
      std::find_if(corners.begin(), corners.end(), [&](std::uint32_t v) { return v >= part.position.size(); });
  if (bad != corners.end()) {
    findings.fail("index_out_of_range", std::to_string(*bad) + " >= " + std::to_string(part.position.size()),
                  place + " element " + std::to_string(bad - corners.begin()));
  }
  return corners;
}

std::vector<Triangle> to_triangles(Mode mode, const std::vector<std::uint32_t>& c) {
  std::vector<Triangle> out(triangle_count(mode, c.size()));
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (mode == Mode::triangles) {
      out[i] = {c[3 * i], c[3 * i + 1], c[3 * i + 2]};
    } else if (mode == Mode::triangle_fan) {
      out[i] = {c[i + 1], c[i + 2], c[0]};
    } else {
      out[i] = i % 2 == 0 ? Triangle{c[i], c[i + 1], c[i + 2]} : Triangle{c[i], c[i + 2], c[i + 1]};
    }
  }
  return out;
}

template <class T, class Make>
std::vector<T> pack(const std::vector<float>& values, std::uint64_t width, const Make& make) {
  std::vector<T> out;
  out.reserve(values.size() / width);
  for (std::size_t i = 0; i + width <= values.size(); i += width) out.push_back(make(values.data() + i));
  return out;
}

Vec4f to_color(const float* c, std::uint64_t width) {
  const auto unit = [](float x) { return std::clamp(x, 0.0F, 1.0F); };
  return {unit(c[0]), unit(c[1]), unit(c[2]), width == 4 ? unit(c[3]) : 1.0F};
}

}  // namespace

void set_attribute(RawPart& part, const std::string& name, const std::vector<float>& values, std::uint64_t width,
                   const std::string& place, Findings& findings) {
  const auto vec2 = [](const float* v) { return Vec2f{v[0], v[1]}; };
  const auto vec3 = [](const float* v) { return Vec3f{v[0], v[1], v[2]}; };
  const auto vec4 = [](const float* v) { return Vec4f{v[0], v[1], v[2], v[3]}; };
  const bool uv = name.substr(0, 9) == "TEXCOORD_", color = name == "COLOR_0";
  const bool fits = uv ? width == 2 : color ? width == 3 || width == 4 : name == "TANGENT" ? width == 4 : width == 3;
  if (!fits) return findings.fail("accessor_type", "The number of components does not fit the attribute.", place);
  if (name == "POSITION") part.position = pack<Vec3f>(values, width, vec3);
  if (name == "NORMAL") part.normal = pack<Vec3f>(values, width, vec3);
  if (name == "TANGENT") part.tangent = pack<Vec4f>(values, width, vec4);
  if (name == "TEXCOORD_0") part.uv0 = pack<Vec2f>(values, width, vec2);
  if (name == "TEXCOORD_1") part.uv1 = pack<Vec2f>(values, width, vec2);
  if (color) part.color = pack<Vec4f>(values, width, [&](const float* c) { return to_color(c, width); });
}

bool has_surface(const Primitive& p) { return p.mode >= Mode::triangles && p.attribute("POSITION") >= 0; }

PrimitiveSize predicted_size(const Document& d, const Primitive& p) {
  const std::uint64_t vertices = accessor(d, p.attribute("POSITION")).count;
  const std::uint64_t corners = p.indices >= 0 ? accessor(d, p.indices).count : vertices;
  const std::uint64_t triangles = triangle_count(p.mode, corners);
  return {p.attribute("NORMAL") >= 0 ? vertices : triangles * 3, triangles};
}

RawPart read_primitive(const AccessorSource& source, const Primitive& primitive, const std::string& place,
                       Findings& findings) {
  RawPart part;
  part.place = place;
  part.material = primitive.material;
  if (primitive.draco.view >= 0) read_draco(source, primitive, part, findings);
  read_attributes(source, primitive, part, findings);
  if (primitive.draco.view >= 0 || findings.failed()) return part;
  const auto corners = read_corners(source, primitive, part, findings);
  if (findings.failed()) return part;
  if (primitive.mode == Mode::triangles && corners.size() % 3 != 0) {
    findings.warn("indices_incomplete", "The number of indices is not a multiple of 3; the rest is left out.", place);
  }
  part.triangles = to_triangles(primitive.mode, corners);
  return part;
}

}  // namespace kiln::gltf
