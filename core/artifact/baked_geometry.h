#pragma once
// The parts of a baked scene as Draco primitives: which streams a part has, on which grids, under which glTF names.

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/artifact/baked_scene.h"
#include "core/artifact/draco_codec.h"
#include "core/artifact/stored_transfer.h"

namespace kiln {

/// A stream and where it appears. Position, normal, texture coordinates and tangent are shared by both scenes.
struct NamedStream {
  std::string name;  // of the attribute: "POSITION", "_PRT_0", ...
  bool in_baked = true;
  bool in_original = true;
  int components = 0;  // floats of an element
};

struct PartPrimitive {
  std::uint32_t part = 0;
  DracoMesh mesh;
  std::vector<NamedStream> names;  // one for each stream
};

/// The vertices that a triangle with three different corners uses, ascending: all that the file will hold.
std::vector<std::uint32_t> used_vertices(const Mesh&);

struct GeometryOptions {
  Encoding encoding;
  const StoredTransfer* transfer = nullptr;  // null leaves the coefficients out (to measure sizes)
  const StoredGlossy* glossy = nullptr;      // null: there are no matrices, or they are left out
  const StoredField* field = nullptr;        // null: there are no r-RFs, or they are left out
};

/// Takes one part at a time, so that no more than one part's streams are in memory. A fault ends the visit.
using PartVisitor = std::function<Result<void>(PartPrimitive)>;

/// Calls `visit` for each part that has a triangle with three different corners, in order.
Result<void> visit_part_primitives(const BakedScene&, const GeometryOptions&, const PartVisitor& visit);

}  // namespace kiln
