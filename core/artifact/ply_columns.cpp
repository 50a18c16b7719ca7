#include "core/artifact/ply_columns.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace kiln {
namespace {

float srgb_to_linear(double s) {
  return static_cast<float>(s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4));
}

}  // namespace

PlyColumns ply_columns(const PlyElement& vertex) {
  std::map<std::string, int> at;
  for (std::size_t i = 0; i < vertex.properties.size(); ++i) at.emplace(vertex.properties[i].name, static_cast<int>(i));
  const auto column = [&](std::initializer_list<const char*> names) {
    for (const char* name : names) {
      if (at.contains(name)) return at[name];
    }
    return -1;
  };
  PlyColumns c{.position = {column({"x"}), column({"y"}), column({"z"})},
               .normal = {column({"nx"}), column({"ny"}), column({"nz"})},
               .color = {column({"red", "r", "diffuse_red"}), column({"green", "g", "diffuse_green"}),
                         column({"blue", "b", "diffuse_blue"})},
               .alpha = column({"alpha", "a"}),
               .uv = {column({"u", "s", "texture_u"}), column({"v", "t", "texture_v"})}};
  if (c.color[0] >= 0) c.color_is_bytes = vertex.properties[static_cast<std::size_t>(c.color[0])].type == PlyType::u8;
  return c;
}

float ply_color(const PlyColumns& c, double value) {
  const double x = std::clamp(value * (c.color_is_bytes ? 1 / 255.0 : 1), 0.0, 1.0);
  return c.color_is_bytes ? srgb_to_linear(x) : static_cast<float>(x);
}

std::optional<std::size_t> ply_corner_list(const PlyElement& face) {
  for (std::size_t i = 0; i < face.properties.size(); ++i) {
    const PlyProperty& p = face.properties[i];
    if (p.list && (p.name == "vertex_indices" || p.name == "vertex_index")) return i;
  }
  return std::nullopt;
}

}  // namespace kiln
