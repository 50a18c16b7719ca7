#pragma once
// grid.exr: an irradiance vector grid as a file. README.md specifies every part and attribute.
// Error   half floats: 2^-11 of a value; what is below 2^-24 of `scale` is kept as that much, never as 0

#include <span>
#include <string>

#include "core/artifact/import.h"
#include "core/grid/grid.h"

namespace kiln {

/// `grid` in unit-cube lengths of `frame`; the file's are the world's. `provenance` is JSON.
Bytes write_grid_exr(const Grid&, const Frame& frame, const std::string& provenance);

/// In world lengths. Fails  exr_unsupported, exr_invalid, image_too_large, grid_invalid
Result<Grid> read_grid_exr(std::span<const std::uint8_t> file, const std::string& name);

/// Whether a file may be a grid: a multi-part OpenEXR file.
bool looks_like_grid(std::span<const std::uint8_t> file);

/// The names of the parts of a blend, in order: phi.x ... b.yz, or px.color ... nz.direction.
std::vector<std::string> grid_part_names(GridBlend);

}  // namespace kiln
