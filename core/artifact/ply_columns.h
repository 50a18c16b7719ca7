#pragma once
// Which properties of a PLY vertex Kiln uses, and where they stand.

#include <optional>

#include "core/artifact/ply_reader.h"
#include "core/base/vec.h"

namespace kiln {

/// Numbers of properties; -1 if absent.
struct PlyColumns {
  int position[3], normal[3], color[3], alpha, uv[2];
  bool color_is_bytes = false;  // then sRGB, else linear

  bool has_position() const { return position[0] >= 0 && position[1] >= 0 && position[2] >= 0; }
  bool has_normal() const { return normal[0] >= 0 && normal[1] >= 0 && normal[2] >= 0; }
  bool has_color() const { return color[0] >= 0 && color[1] >= 0 && color[2] >= 0; }
  bool has_uv() const { return uv[0] >= 0 && uv[1] >= 0; }
};
PlyColumns ply_columns(const PlyElement& vertex);

/// Linear from a colour number as the file has it, limited to [0, 1].
float ply_color(const PlyColumns&, double value);

/// The property that lists a face's corners, or nothing.
std::optional<std::size_t> ply_corner_list(const PlyElement& face);

}  // namespace kiln
