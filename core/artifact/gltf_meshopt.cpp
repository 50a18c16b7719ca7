#include <meshoptimizer.h>

#include "core/artifact/gltf_bytes.h"

namespace kiln::gltf {
namespace {

/// Strides that the decoders and the filters take; they assert on others.
bool stride_fits(const Meshopt& m) {
  const std::uint64_t s = m.stride;
  if (m.mode != MeshoptMode::attributes) return (s == 2 || s == 4) && m.filter == MeshoptFilter::none;
  if (s == 0 || s > 256 || s % 4 != 0) return false;
  if (m.filter == MeshoptFilter::octahedral) return s == 4 || s == 8;
  if (m.filter == MeshoptFilter::quaternion) return s == 8;
  return true;
}

/// The least size of an encoding: a triangle takes a byte, an index a byte, 16 bytes of vertices two bits.
bool plausible(const Meshopt& m) {
  const std::uint64_t decoded = m.count * m.stride;
  return m.mode == MeshoptMode::attributes  ? decoded <= m.bytes * 64 + 64 * 1024
         : m.mode == MeshoptMode::triangles ? m.count / 3 <= m.bytes && m.count % 3 == 0
                                            : m.count <= m.bytes;
}

int decode(const Meshopt& m, Span encoded, Bytes& out) {
  switch (m.mode) {
    case MeshoptMode::triangles:
      return meshopt_decodeIndexBuffer(out.data(), m.count, m.stride, encoded.data(), encoded.size());
    case MeshoptMode::indices:
      return meshopt_decodeIndexSequence(out.data(), m.count, m.stride, encoded.data(), encoded.size());
    default:
      return meshopt_decodeVertexBuffer(out.data(), m.count, m.stride, encoded.data(), encoded.size());
  }
}

void apply_filter(const Meshopt& m, Bytes& out) {
  switch (m.filter) {
    case MeshoptFilter::octahedral:
      return meshopt_decodeFilterOct(out.data(), m.count, m.stride);
    case MeshoptFilter::quaternion:
      return meshopt_decodeFilterQuat(out.data(), m.count, m.stride);
    case MeshoptFilter::exponential:
      return meshopt_decodeFilterExp(out.data(), m.count, m.stride);
    case MeshoptFilter::none:
      return;
  }
}

}  // namespace

Bytes decode_meshopt(const Meshopt& m, Span encoded, const std::string& place, Findings& findings) {
  Bytes out;
  if (!stride_fits(m) || !plausible(m)) {
    findings.fail("meshopt_invalid", "Stride or count do not fit the compressed data.", place);
    return out;
  }
  // The vertex filters work on groups of four elements.
  out.resize((m.count + 3) / 4 * 4 * m.stride);
  if (decode(m, encoded, out) != 0) {
    findings.fail("meshopt_invalid", "The compressed data cannot be decoded.", place);
    return {};
  }
  apply_filter(m, out);
  out.resize(m.count * m.stride);
  return out;
}

}  // namespace kiln::gltf
