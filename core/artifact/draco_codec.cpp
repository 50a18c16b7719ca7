#include "core/artifact/draco_codec.h"

#include <draco/compression/decode.h>
#include <draco/compression/expert_encode.h>

#include <algorithm>
#include <cmath>
#include <new>
#include <stdexcept>

#include "core/artifact/draco_header.h"
#include "core/base/expects.h"

namespace kiln {
namespace {

draco::GeometryAttribute::Type draco_type(StreamKind kind) {
  switch (kind) {
    case StreamKind::position:
      return draco::GeometryAttribute::POSITION;
    case StreamKind::normal:
      return draco::GeometryAttribute::NORMAL;
    case StreamKind::texcoord:
      return draco::GeometryAttribute::TEX_COORD;
    case StreamKind::color:
      return draco::GeometryAttribute::COLOR;
    case StreamKind::generic:
      return draco::GeometryAttribute::GENERIC;
  }
  return draco::GeometryAttribute::GENERIC;
}

int add_stream(draco::Mesh& mesh, const VertexStream& stream, std::size_t vertices) {
  EXPECTS(stream.values.size() == vertices * static_cast<std::size_t>(stream.components));
  EXPECTS(std::ranges::all_of(stream.values, [](float v) { return std::isfinite(v); }));
  draco::GeometryAttribute attribute;
  const auto stride = static_cast<std::int64_t>(sizeof(float)) * stream.components;
  attribute.Init(draco_type(stream.kind), nullptr, static_cast<std::uint8_t>(stream.components), draco::DT_FLOAT32,
                 false, stride, 0);
  const int id = mesh.AddAttribute(attribute, true, static_cast<std::uint32_t>(vertices));
  for (std::size_t v = 0; v < vertices; ++v) {
    mesh.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(static_cast<std::uint32_t>(v)),
                                          &stream.values[v * static_cast<std::size_t>(stream.components)]);
  }
  return id;
}

std::unique_ptr<draco::Mesh> draco_mesh(DracoMesh& source) {
  auto mesh = std::make_unique<draco::Mesh>();
  const std::size_t vertices = source.streams[0].values.size() / 3;
  mesh->set_num_points(static_cast<std::uint32_t>(vertices));
  mesh->SetNumFaces(source.triangles.size());
  for (std::size_t f = 0; f < source.triangles.size(); ++f) {
    draco::Mesh::Face face;
    for (int c = 0; c < 3; ++c) face[c] = draco::PointIndex(source.triangles[f][static_cast<std::size_t>(c)]);
    mesh->SetFace(draco::FaceIndex(static_cast<std::uint32_t>(f)), face);
  }
  for (VertexStream& stream : source.streams) {
    add_stream(*mesh, stream, vertices);
    stream.values = {};
  }
  return mesh;
}

void set_grid(draco::ExpertEncoder& encoder, int id, const VertexStream& stream) {
  if (stream.kind == StreamKind::normal) {
    encoder.SetAttributeQuantization(id, stream.bits);
  } else {
    encoder.SetAttributeExplicitQuantization(id, stream.bits, stream.components, stream.origin.data(), stream.range);
  }
}

bool encode_with(int method, const draco::Mesh& mesh, const DracoMesh& source, int speed, Bytes& out) {
  draco::ExpertEncoder encoder(mesh);
  encoder.SetSpeedOptions(speed, speed);
  encoder.SetEncodingMethod(method);
  for (std::size_t id = 0; id < source.streams.size(); ++id)
    set_grid(encoder, static_cast<int>(id), source.streams[id]);
  draco::EncoderBuffer buffer;
  if (!encoder.EncodeToBuffer(&buffer).ok()) return false;
  out.assign(buffer.data(), buffer.data() + buffer.size());
  return true;
}

DecodedStream decoded_stream(const draco::PointAttribute& attribute, std::uint32_t vertices) {
  DecodedStream out{attribute.num_components(), {}};
  const auto components = static_cast<std::size_t>(out.components);
  out.values.resize(components * vertices);
  for (std::uint32_t v = 0; v < vertices; ++v) {
    const auto value = attribute.mapped_index(draco::PointIndex(v));
    if (value.value() >= attribute.size()) return {};
    attribute.ConvertValue<float>(value, static_cast<std::int8_t>(components), &out.values[v * components]);
  }
  return out;
}

Result<DecodedMesh> copy_out(const draco::Mesh& mesh, bool positions_only) {
  DecodedMesh out;
  out.vertices = mesh.num_points();
  out.triangles.resize(mesh.num_faces());
  for (std::uint32_t f = 0; f < mesh.num_faces(); ++f) {
    const auto& face = mesh.face(draco::FaceIndex(f));
    for (int c = 0; c < 3; ++c) out.triangles[f][static_cast<std::size_t>(c)] = face[c].value();
  }
  const auto in_range = [&](const Triangle& t) {
    return std::ranges::all_of(t, [&](auto v) { return v < out.vertices; });
  };
  if (!std::ranges::all_of(out.triangles, in_range)) return fault("draco_damaged", "A face names a missing vertex.");
  for (int i = 0; i < mesh.num_attributes(); ++i) {
    const draco::PointAttribute& attribute = *mesh.attribute(i);
    if (attribute.num_components() < 1 || attribute.num_components() > 4 || !attribute.buffer()) {
      return fault("draco_damaged", "An attribute has a number of components that no accessor can have.");
    }
    if (positions_only && attribute.attribute_type() != draco::GeometryAttribute::POSITION) continue;
    out.streams[attribute.unique_id()] = decoded_stream(attribute, out.vertices);
  }
  return out;
}

/// Asked ahead, so that a damaged file cannot make the decoder ask for gigabytes.
bool states_sizes_within(std::span<const std::uint8_t> bytes, const DracoDecode& options) {
  const auto header = read_draco_header(bytes);
  return header && header->vertices <= options.max_vertices && header->faces <= options.max_triangles;
}

Result<DecodedMesh> decode_checked(std::span<const std::uint8_t> bytes, const DracoDecode& options) {
  if (!states_sizes_within(bytes, options)) {
    return fault("draco_damaged", "The compressed geometry is larger than its accessors say.");
  }
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  draco::Decoder decoder;
  auto mesh = decoder.DecodeMeshFromBuffer(&buffer);
  if (!mesh.ok()) return fault("draco_damaged", "The compressed geometry cannot be decoded.");
  if (mesh.value()->num_points() > options.max_vertices || mesh.value()->num_faces() > options.max_triangles) {
    return fault("draco_damaged", "The compressed geometry is larger than its accessors say.");
  }
  return copy_out(*mesh.value(), options.positions_only);
}

}  // namespace

Result<Bytes> encode_draco(DracoMesh source, int speed) {
  EXPECTS(!source.triangles.empty() && !source.streams.empty() && source.streams[0].kind == StreamKind::position);
  const auto mesh = draco_mesh(source);
  Bytes out;
  if (encode_with(draco::MESH_EDGEBREAKER_ENCODING, *mesh, source, speed, out)) return out;
  if (encode_with(draco::MESH_SEQUENTIAL_ENCODING, *mesh, source, speed, out)) return out;
  return fault("draco_refused", "The geometry of a part cannot be compressed.");
}

Result<DecodedMesh> decode_draco(std::span<const std::uint8_t> bytes, const DracoDecode& options) try {
  return decode_checked(bytes, options);
} catch (const std::bad_alloc&) {
  return fault("draco_damaged", "The compressed geometry asks for more memory than there is.");
} catch (const std::length_error&) {
  return fault("draco_damaged", "The compressed geometry states an impossible size.");
}

}  // namespace kiln
