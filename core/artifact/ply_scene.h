#pragma once
// PLY: Stanford's polygon files, as scanners write them.

#include <cstdint>
#include <span>

#include "core/artifact/findings.h"
#include "core/artifact/import.h"

namespace kiln {

bool looks_like_ply(std::span<const std::uint8_t> file);

/// ASCII and binary of both byte orders, version 1.0. Vertex properties x y z, nx ny nz, red green blue alpha, u v / s
/// t; faces by vertex_indices or vertex_index, polygons as fans. Other elements and properties are skipped. Missing
/// normals are smooth: a scan is one surface. Colours are taken as sRGB when they are bytes. Fails with ply_invalid,
/// ply_truncated, index_out_of_range, non_finite_geometry and the codes of assemble().
Scene import_ply(std::span<const std::uint8_t> file, const ImportLimits&, Findings&);

}  // namespace kiln
