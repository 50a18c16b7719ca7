#include <draco/compression/decode.h>

#include <cmath>

#include "core/artifact/draco_header.h"
#include "core/artifact/gltf_primitive.h"

namespace kiln::gltf {
namespace {

/// The densest real streams (flat regular grids) hold a few hundred faces in a byte.
constexpr std::uint64_t kMaxFacesPerByte = 2048;

Span stream_of(const AccessorSource& source, const Primitive& p) {
  return source.bytes.views[static_cast<std::size_t>(p.draco.view)];
}

const Accessor& accessor(const AccessorSource& source, int i) {
  return source.document.accessors[static_cast<std::size_t>(i)];
}

std::string mismatch(const char* what, std::uint64_t stream, std::uint64_t accessors) {
  return "The stream has " + std::to_string(stream) + " " + what + ", the accessors " + std::to_string(accessors) + ".";
}

/// Compares the stream's header with the accessors. After this the decoder cannot be made to allocate without bound.
bool header_agrees(const AccessorSource& source, const Primitive& p, const std::string& place, Findings& findings) {
  const Span stream = stream_of(source, p);
  const auto header = read_draco_header(stream);
  if (!header) {
    findings.fail("draco_invalid", "The data is not a Draco 2.2 triangle mesh.", place);
    return false;
  }
  const std::uint64_t points = accessor(source, p.attribute("POSITION")).count;
  const std::uint64_t faces = p.indices >= 0 ? accessor(source, p.indices).count / 3 : header->faces;
  if (header->faces != faces || header->faces > stream.size() * kMaxFacesPerByte) {
    findings.fail("draco_count_mismatch", mismatch("faces", header->faces, faces), place);
  } else if (header->vertices > points || (header->sequential && header->vertices != points)) {
    findings.fail("draco_count_mismatch", mismatch("vertices", header->vertices, points), place);
  }
  return !findings.failed();
}

std::unique_ptr<draco::Mesh> decode(Span stream) {
  try {
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char*>(stream.data()), stream.size());
    auto result = draco::Decoder().DecodeMeshFromBuffer(&buffer);
    return result.ok() ? std::move(result).value() : nullptr;
  } catch (const std::exception&) {
    return nullptr;
  }
}

/// Integers that the accessor calls normalised but the stream does not.
float normalization(const Accessor& a, const draco::PointAttribute& attribute) {
  if (!a.normalized || attribute.normalized()) return 1;
  switch (a.component) {
    case Component::i8:
      return 1 / 127.0F;
    case Component::u8:
      return 1 / 255.0F;
    case Component::i16:
      return 1 / 32767.0F;
    case Component::u16:
      return 1 / 65535.0F;
    default:
      return 1;
  }
}

std::vector<float> floats_of(const draco::Mesh& mesh, const draco::PointAttribute& attribute, const Accessor& a) {
  const std::uint64_t width = a.width;
  const float scale = normalization(a, attribute);
  std::vector<float> out(mesh.num_points() * width);
  for (draco::PointIndex i(0); i < mesh.num_points(); ++i) {
    float* at = out.data() + i.value() * width;
    attribute.ConvertValue<float>(attribute.mapped_index(i), static_cast<std::int8_t>(width), at);
    for (std::uint64_t c = 0; c < width; ++c) at[c] *= scale;
  }
  return out;
}

/// Empty after a fault.
std::vector<float> attribute_of(const AccessorSource& source, const draco::Mesh& mesh, const Primitive& p,
                                const std::string& name, const std::string& place, Findings& findings) {
  const auto* attribute = mesh.GetAttributeByUniqueId(static_cast<std::uint32_t>(p.draco.attributes.at(name)));
  const Accessor& a = accessor(source, p.attribute(name.c_str()));
  if (!attribute || a.width > 4 || attribute->num_components() != static_cast<int>(a.width)) {
    findings.fail("draco_invalid", "The stream does not have the attribute as the accessor says.", place);
    return {};
  }
  auto values = floats_of(mesh, *attribute, a);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isfinite(values[i])) continue;
    findings.fail("non_finite_geometry", "A value is not finite.", place + " element " + std::to_string(i / a.width));
    return {};
  }
  return values;
}

void take_triangles(const draco::Mesh& mesh, RawPart& part, Findings& findings) {
  part.triangles.reserve(mesh.num_faces());
  for (draco::FaceIndex f(0); f < mesh.num_faces(); ++f) {
    const auto& face = mesh.face(f);
    part.triangles.push_back({face[0].value(), face[1].value(), face[2].value()});
    for (const std::uint32_t v : part.triangles.back()) {
      if (v < mesh.num_points()) continue;
      return findings.fail("index_out_of_range", std::to_string(v) + " >= " + std::to_string(mesh.num_points()),
                           part.place + "/indices element " + std::to_string(f.value() * 3));
    }
  }
}

/// Nothing after a fault.
std::unique_ptr<draco::Mesh> decode_checked(const AccessorSource& source, const Primitive& p, const std::string& place,
                                            Findings& findings) {
  if (p.mode != Mode::triangles && p.mode != Mode::triangle_strip) {
    findings.fail("draco_invalid", "Only triangles and strips can be compressed.", place);
    return nullptr;
  }
  if (!header_agrees(source, p, place, findings)) return nullptr;
  auto mesh = decode(stream_of(source, p));
  const std::uint64_t points = accessor(source, p.attribute("POSITION")).count;
  if (!mesh) {
    findings.fail("draco_invalid", "The compressed data cannot be decoded.", place);
  } else if (mesh->num_points() != points) {
    findings.fail("draco_count_mismatch", mismatch("vertices", mesh->num_points(), points), place);
  }
  return findings.failed() ? nullptr : std::move(mesh);
}

}  // namespace

void read_draco(const AccessorSource& source, const Primitive& p, RawPart& part, Findings& findings) {
  const auto mesh = decode_checked(source, p, part.place + "/extensions/KHR_draco_mesh_compression", findings);
  if (!mesh) return;
  take_triangles(*mesh, part, findings);
  for (const char* name : kAttributes) {
    const int index = p.attribute(name);
    if (index < 0 || findings.failed() || !p.draco.attributes.contains(name)) continue;
    const std::string place = part.place + "/attributes/" + name;
    const auto values = attribute_of(source, *mesh, p, name, place, findings);
    if (!findings.failed()) set_attribute(part, name, values, accessor(source, index).width, place, findings);
  }
}

std::vector<std::vector<float>> read_draco_attributes(const AccessorSource& source, const Primitive& p,
                                                      const std::vector<std::string>& names, const std::string& place,
                                                      Findings& findings) {
  std::vector<std::vector<float>> out;
  const auto mesh = decode_checked(source, p, place + "/extensions/KHR_draco_mesh_compression", findings);
  for (std::size_t i = 0; mesh && i < names.size() && !findings.failed(); ++i)
    out.push_back(attribute_of(source, *mesh, p, names[i], place + "/attributes/" + names[i], findings));
  return out;
}

}  // namespace kiln::gltf
