#pragma once
// One glTF primitive to a RawPart.

#include "core/artifact/gltf_accessor.h"
#include "core/artifact/raw_part.h"

namespace kiln::gltf {

/// Whether the primitive has surface at all: triangles, strip or fan, with positions.
bool has_surface(const Primitive&);

/// An upper bound of vertices and triangles after reading, from counts alone.
struct PrimitiveSize {
  std::uint64_t vertices = 0, triangles = 0;
};
PrimitiveSize predicted_size(const Document&, const Primitive&);

/// Attributes and triangles as the file has them; strips and fans unrolled, missing indices made, Draco decoded.
/// Fails with index_out_of_range, accessor_type, non_finite_geometry and the codes of Draco.
RawPart read_primitive(const AccessorSource&, const Primitive&, const std::string& place, Findings&);

/// KHR_draco_mesh_compression: fills attributes and triangles. Counts in the compressed header must agree with the
/// accessors before anything is decoded. Fails with draco_invalid, draco_count_mismatch.
void read_draco(const AccessorSource&, const Primitive&, RawPart&, Findings&);

/// Attributes that the compressed data holds, as floats of their accessors' width. Fails as read_draco.
std::vector<std::vector<float>> read_draco_attributes(const AccessorSource&, const Primitive&,
                                                      const std::vector<std::string>& names, const std::string& place,
                                                      Findings&);

/// Puts `width` floats for each vertex into the attribute called `name`; others are ignored.
/// Fails with accessor_type if the width does not fit the name.
void set_attribute(RawPart&, const std::string& name, const std::vector<float>& values, std::uint64_t width,
                   const std::string& place, Findings&);

/// The attributes that a bake uses.
inline constexpr const char* kAttributes[] = {"POSITION", "NORMAL", "TANGENT", "TEXCOORD_0", "TEXCOORD_1", "COLOR_0"};

}  // namespace kiln::gltf
