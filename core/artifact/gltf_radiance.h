#pragma once
// Radiance functions that the vertices of a glTF carry (KILN_radiance_functions; carried.md says what a file may hold).

#include <span>

#include "core/artifact/affine.h"
#include "core/artifact/gltf_placement.h"
#include "core/artifact/gltf_primitive.h"
#include "core/lightfield/light_field.h"

namespace kiln::gltf {

/// Version and degree. Fails with unsupported_version and number_out_of_range; warns of attributes without declaration.
void check_declaration(const Document&, Findings&);

void warn_of_unused_radiance(Findings&);

/// Fills `part.radiance` from the attributes of the primitive that `part` was read from, before it is cleaned: as RFs,
/// not reflected, in harmonics of the part's own axes.
/// Fails with radiance_incomplete, radiance_count_mismatch, accessor_type, radiance_without_normals,
/// tangents_invalid, non_finite_geometry, number_out_of_range and the codes of Draco.
void read_radiance(const AccessorSource&, const Primitive&, RawPart&, Findings&);

/// Directions can be turned and mirrored, not sheared: fails with radiance_transform where an instance does that.
void check_turns(std::span<const Placement>, Findings&);

}  // namespace kiln::gltf
