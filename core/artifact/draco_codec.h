#pragma once
// Draco in our own types: a triangle list with float streams in, bytes out, and back.
//
// Every stream is quantised on a grid that the caller states (never on the data's own extent), so that equal values in
// two primitives decode to equal values: no cracks, and the same error bound everywhere.

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "core/artifact/import.h"
#include "core/base/result.h"
#include "core/mesh/mesh.h"

namespace kiln {

enum class StreamKind { position, normal, texcoord, color, generic };

/// One float attribute. `bits` levels cover [origin, origin + range] in every component; an octahedral grid for normals
/// (origin and range unused). Error at most range / (2^bits - 1) / 2.
struct VertexStream {
  StreamKind kind = StreamKind::generic;
  int components = 3;
  int bits = 12;
  std::array<float, 4> origin{};
  float range = 1;
  std::vector<float> values;  // components x vertices
};

/// What goes into one Draco primitive. The id of a stream in the file is its index here; stream 0 is the position.
struct DracoMesh {
  std::vector<Triangle> triangles;
  std::vector<VertexStream> streams;
};

struct DecodedStream {
  int components = 0;
  std::vector<float> values;
};

struct DecodedMesh {
  std::uint32_t vertices = 0;
  std::vector<Triangle> triangles;
  std::map<std::uint32_t, DecodedStream> streams;  // by id
};

/// Edgebreaker, or sequential where edgebreaker cannot take the mesh. Vertices come back reordered and, at non-manifold
/// places, doubled.  Repeat: same bytes for same input.  Expects finite values, indices in range, at least a triangle.
/// Memory  streams are freed as they are taken over, so that values exist once while they are compressed.
Result<Bytes> encode_draco(DracoMesh, int speed);

/// `max_vertices` and `max_triangles` are what the file's accessors promise.
struct DracoDecode {
  std::uint64_t max_vertices = 0, max_triangles = 0;
  bool positions_only = false;  // leave the other streams out of the result
};

/// Decodes untrusted bytes. Fails with draco_damaged.
Result<DecodedMesh> decode_draco(std::span<const std::uint8_t> bytes, const DracoDecode&);

}  // namespace kiln
