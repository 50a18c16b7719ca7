#pragma once
// The parts of a baked scene as Draco primitives: which streams a part has, on which grids, under which glTF names.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/artifact/baked_scene.h"
#include "core/artifact/draco_codec.h"
#include "core/artifact/prt_slots.h"

namespace kiln {

/// A stream and where it appears. Position, normal, texture coordinates and tangent are shared by both scenes.
struct NamedStream {
  std::string name;  // of the attribute: "POSITION", "_PRT_0", ...
  bool in_baked = true;
  bool in_original = true;
};

struct PartPrimitive {
  std::uint32_t part = 0;
  DracoMesh mesh;
  std::vector<NamedStream> names;  // one for each stream
};

/// The vertices that a triangle with three different corners uses, ascending: all that the file will hold.
std::vector<std::uint32_t> used_vertices(const Mesh&);

/// What of a part's streams is made; measuring sizes leaves the coefficients out.
struct GeometryOptions {
  Encoding encoding;
  bool coefficients = true;
};

/// One primitive for each part that has such a triangle. `colors` is COLOR_0's displayed light of every vertex.
std::vector<PartPrimitive> part_primitives(const BakedScene&, const SlotRanges&, std::span<const Vec3f> colors,
                                           const GeometryOptions&);

}  // namespace kiln
