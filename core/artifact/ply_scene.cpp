#include "core/artifact/ply_scene.h"

#include <algorithm>
#include <cmath>

#include "core/artifact/assemble.h"
#include "core/artifact/ply_columns.h"
#include "core/artifact/raw_part.h"

namespace kiln {
namespace {

using Span = std::span<const std::uint8_t>;

Vec3f pick3(const std::vector<double>& row, const int (&c)[3]) {
  const auto at = [&](int i) { return static_cast<float>(row[static_cast<std::size_t>(c[i])]); };
  return {at(0), at(1), at(2)};
}

Vec4f pick_color(const std::vector<double>& row, const PlyColumns& c) {
  const double unit = c.color_is_bytes ? 1 / 255.0 : 1;
  const auto linear = [&](int column) { return ply_color(c, row[static_cast<std::size_t>(column)]); };
  return {linear(c.color[0]), linear(c.color[1]), linear(c.color[2]),
          c.alpha < 0 ? 1.0F : static_cast<float>(std::clamp(row[static_cast<std::size_t>(c.alpha)] * unit, 0.0, 1.0))};
}

/// v runs upwards in PLY files that have it, downwards in glTF.
void take_vertex(const std::vector<double>& row, const PlyColumns& c, RawPart& part) {
  part.position.push_back(pick3(row, c.position));
  if (c.has_normal()) part.normal.push_back(pick3(row, c.normal));
  if (c.has_color()) part.color.push_back(pick_color(row, c));
  if (c.has_uv()) {
    part.uv0.push_back({static_cast<float>(row[static_cast<std::size_t>(c.uv[0])]),
                        1 - static_cast<float>(row[static_cast<std::size_t>(c.uv[1])])});
  }
}

std::string element_place(const PlyElement& e, std::uint64_t i) {
  return "element " + std::string(e.name == "vertex" || e.name == "face" ? e.name : "other") + " " + std::to_string(i);
}

void fail_truncated(const PlyElement& e, std::uint64_t i, Findings& findings) {
  findings.fail("ply_truncated", "The file ends, or no number stands where one must.", element_place(e, i));
}

/// Reads one property; a list into `values`, a single number as a list of one.
bool read_property(PlyNumbers& in, const PlyProperty& p, std::vector<double>& values) {
  const auto count = p.list ? in.next_count(*p.list) : std::optional<std::uint64_t>(1);
  if (!count) return false;
  values.clear();
  for (std::uint64_t i = 0; i < *count; ++i) {
    const auto value = in.next(p.type);
    if (!value) return false;
    values.push_back(*value);
  }
  return true;
}

/// Vertices from line `first` on; rows of the element in file order.
void read_vertices(PlyNumbers& in, const PlyElement& e, RawPart& part, Findings& findings) {
  const PlyColumns columns = ply_columns(e);
  if (!columns.has_position()) return findings.fail("ply_invalid", "Vertices have no x, y and z.", "header");
  std::vector<double> row(e.properties.size()), values;
  for (std::uint64_t i = 0; i < e.count; ++i) {
    for (std::size_t p = 0; p < e.properties.size(); ++p) {
      if (!read_property(in, e.properties[p], values)) return fail_truncated(e, i, findings);
      row[p] = values.empty() ? 0 : values[0];
      if (!std::isfinite(static_cast<float>(row[p]))) {
        return findings.fail("non_finite_geometry", "A value is not finite.", element_place(e, i));
      }
    }
    take_vertex(row, columns, part);
  }
}

void read_faces(PlyNumbers& in, const PlyElement& e, RawPart& part, Findings& findings) {
  std::vector<double> values, corners;
  const auto corner_list = ply_corner_list(e);
  if (!corner_list) {
    return findings.fail("ply_invalid", "Faces have no list of vertex_indices.", "header");
  }
  for (std::uint64_t i = 0; i < e.count; ++i) {
    for (std::size_t p = 0; p < e.properties.size(); ++p) {
      if (!read_property(in, e.properties[p], values)) return fail_truncated(e, i, findings);
      if (p == *corner_list) corners = values;
    }
    for (const double v : corners) {
      if (v >= 0 && v < static_cast<double>(part.position.size()) && v == std::floor(v)) continue;
      return findings.fail("index_out_of_range",
                           "A vertex index is not one of the " + std::to_string(part.position.size()) + " vertices.",
                           element_place(e, i));
    }
    for (std::size_t k = 2; k < corners.size(); ++k) {
      part.triangles.push_back({static_cast<std::uint32_t>(corners[0]), static_cast<std::uint32_t>(corners[k - 1]),
                                static_cast<std::uint32_t>(corners[k])});
    }
  }
}

void skip_element(PlyNumbers& in, const PlyElement& e, Findings& findings) {
  std::vector<double> values;
  if (e.properties.empty()) return;
  for (std::uint64_t i = 0; i < e.count; ++i) {
    for (const PlyProperty& p : e.properties) {
      if (!read_property(in, p, values)) return fail_truncated(e, i, findings);
    }
  }
}

RawPart read_part(Span file, Findings& findings) {
  RawPart part;
  part.name = "ply";
  part.material = 0;
  const PlyHeader header = read_ply_header(file, findings);
  PlyNumbers in(file.subspan(header.bytes), header.form);
  for (const PlyElement& e : header.elements) {
    if (findings.failed()) break;
    if (e.name == "vertex") {
      read_vertices(in, e, part, findings);
    } else if (e.name == "face") {
      read_faces(in, e, part, findings);
    } else {
      skip_element(in, e, findings);
    }
  }
  return part;
}

}  // namespace

bool looks_like_ply(Span file) {
  return file.size() >= 4 && file[0] == 'p' && file[1] == 'l' && file[2] == 'y' && (file[3] == '\n' || file[3] == '\r');
}

Scene import_ply(Span file, const ImportLimits& limits, Findings& findings) {
  LitScene lit;
  std::vector<RawPart> parts;
  parts.push_back(read_part(file, findings));
  if (findings.failed()) return {};
  clean_part(parts[0], MissingNormals::smooth, findings);
  lit.scene.materials.push_back({.name = "default", .metallic = 0, .roughness = 1});
  assemble(parts, {{.part = 0, .name = "ply", .instances = {Affine{}}}}, limits, lit, findings);
  return std::move(lit.scene);
}

}  // namespace kiln
