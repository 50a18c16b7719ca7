#include "client_cli/values.h"

#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "client_cli/csv.h"
#include "client_cli/files.h"

namespace kiln {
namespace {

using nlohmann::json;

const std::vector<std::string> kPointColumns{"x", "y", "z", "nx", "ny", "nz", "vx", "vy", "vz"};
constexpr std::array<const char*, 3> kChannels{"_r", "_g", "_b"};

Outcome<std::array<std::size_t, 3>> find_three(const CsvTable& table, const std::array<std::string, 3>& names,
                                               const std::string& path) {
  std::array<std::size_t, 3> places{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto place = table.find(names[i]);
    if (!place) return fail(ExitCode::rejected, "missing_column", "has no column " + names[i], path);
    places[i] = *place;
  }
  return places;
}

std::array<std::string, 3> channel_names(const std::string& name) {
  return {name + kChannels[0], name + kChannels[1], name + kChannels[2]};
}

Vec3d three_of(const std::vector<double>& row, const std::array<std::size_t, 3>& places) {
  return {row[places[0]], row[places[1]], row[places[2]]};
}

Outcome<std::vector<QueryPoint>> points_of(const CsvTable& table, const std::string& path) {
  KILN_TRY(position, find_three(table, {"x", "y", "z"}, path));
  KILN_TRY(normal, find_three(table, {"nx", "ny", "nz"}, path));
  std::array<std::size_t, 3> view{};
  const bool has_view = table.find("vx") || table.find("vy") || table.find("vz");
  if (has_view) {
    KILN_TRY(found, find_three(table, {"vx", "vy", "vz"}, path));
    view = found;
  }
  std::vector<QueryPoint> points;
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    points.push_back({three_of(table.rows[i], position), three_of(table.rows[i], normal), std::nullopt});
    if (has_view) points.back().view = three_of(table.rows[i], view);
    if (has_view && !(is_finite(*points.back().view) && length(*points.back().view) > 0)) {
      return fail(ExitCode::rejected, "not_finite", "the view direction must be finite and not zero",
                  path + ": line " + std::to_string(table.lines[i]));
    }
    if (is_finite(points.back().position) && is_finite(points.back().normal)) continue;
    return fail(ExitCode::rejected, "not_finite", "position and normal must be finite numbers",
                path + ": line " + std::to_string(table.lines[i]));
  }
  return points;
}

Outcome<CsvTable> read_table(const std::string& path) {
  KILN_TRY(text, read_text(path));
  return parse_csv(text, path, kPointColumns);
}

void append(std::string& out, const Vec3d& value) {
  for (std::size_t i = 0; i < 3; ++i) out += (out.empty() || out.back() == '\n' ? "" : ",") + number_text(value[i]);
}

/// Light values are floats at heart: nine digits say all of them.
void append_value(std::string& out, const Vec3d& value) {
  for (std::size_t i = 0; i < 3; ++i) out += "," + number_text(static_cast<float>(value[i]));
}

json rgb_json(const Vec3d& v) {
  return std::isfinite(v.x) ? json{static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)} : json();
}

json point_json(const QueryPoint& point) {
  json out = {{"position", {point.position.x, point.position.y, point.position.z}},
              {"normal", {point.normal.x, point.normal.y, point.normal.z}}};
  if (point.view) out["view"] = {point.view->x, point.view->y, point.view->z};
  return out;
}

/// A file has views for all of its points or for none.
bool have_views(const std::vector<QueryPoint>& points) { return !points.empty() && points[0].view; }

std::string point_names(const std::vector<QueryPoint>& points) {
  return have_views(points) ? "x,y,z,nx,ny,nz,vx,vy,vz" : "x,y,z,nx,ny,nz";
}

std::string names_line(const std::vector<QueryPoint>& points, bool errors) {
  std::string line = point_names(points);
  const auto add = [&](const std::string& name) {
    for (const auto& channel : channel_names(name)) line += "," + channel;
  };
  add("irradiance");
  add("radiance");
  line += ",distance";
  if (errors) {
    add("irradiance_se");
    add("radiance_se");
  }
  return line + "\n";
}

}  // namespace

Outcome<std::vector<QueryPoint>> read_points(const std::string& path) {
  KILN_TRY(table, read_table(path));
  if (table.columns.empty()) return std::vector<QueryPoint>{};
  return points_of(table, path);
}

std::string points_csv(const std::vector<QueryPoint>& points) {
  std::string out = point_names(points) + "\n";
  for (const QueryPoint& point : points) {
    append(out, point.position);
    append_value(out, point.normal);
    if (point.view) append_value(out, *point.view);
    out += '\n';
  }
  return out;
}

std::string points_json(const std::vector<QueryPoint>& points) {
  json out = json::array();
  for (const QueryPoint& point : points) out.push_back(point_json(point));
  return out.dump() + "\n";
}

Outcome<ValueTable> read_values(const std::string& path) {
  KILN_TRY(table, read_table(path));
  if (table.columns.empty()) return fail(ExitCode::rejected, "missing_column", "is empty", path);
  KILN_TRY(points, points_of(table, path));
  KILN_TRY(irradiance, find_three(table, channel_names("irradiance"), path));
  KILN_TRY(radiance, find_three(table, channel_names("radiance"), path));
  ValueTable out{std::move(points), {}, table.find("irradiance_se_r").has_value()};
  std::array<std::size_t, 3> irradiance_error{}, radiance_error{};
  if (out.has_errors) {
    KILN_TRY(first, find_three(table, channel_names("irradiance_se"), path));
    KILN_TRY(second, find_three(table, channel_names("radiance_se"), path));
    irradiance_error = first;
    radiance_error = second;
  }
  const auto distance = table.find("distance");
  for (const auto& row : table.rows) {
    LightValue value{three_of(row, irradiance), three_of(row, radiance), distance ? row[*distance] : 0.0, {}, {}};
    if (out.has_errors) {
      value.irradiance_error = three_of(row, irradiance_error);
      value.radiance_error = three_of(row, radiance_error);
    }
    out.values.push_back(value);
  }
  return out;
}

std::string values_csv(const ValueTable& table) {
  std::string out = names_line(table.points, table.has_errors);
  for (std::size_t i = 0; i < table.points.size(); ++i) {
    const LightValue& value = table.values[i];
    append(out, table.points[i].position);
    append(out, table.points[i].normal);
    if (table.points[i].view) append(out, *table.points[i].view);
    append_value(out, value.irradiance);
    append_value(out, value.radiance);
    out += "," + number_text(static_cast<float>(value.distance));
    if (table.has_errors) {
      append_value(out, value.irradiance_error);
      append_value(out, value.radiance_error);
    }
    out += '\n';
  }
  return out;
}

std::string values_json(const ValueTable& table) {
  json out = json::array();
  for (std::size_t i = 0; i < table.points.size(); ++i) {
    const LightValue& value = table.values[i];
    json row = point_json(table.points[i]);
    row["irradiance_rgb"] = rgb_json(value.irradiance);
    row["radiance_rgb"] = rgb_json(value.radiance);
    row["distance"] = std::isfinite(value.distance) ? json(static_cast<float>(value.distance)) : json();
    if (table.has_errors) {
      row["irradiance_se_rgb"] = rgb_json(value.irradiance_error);
      row["radiance_se_rgb"] = rgb_json(value.radiance_error);
    }
    out.push_back(std::move(row));
  }
  return out.dump() + "\n";
}

LightValue no_value() {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Vec3d none{nan, nan, nan};
  return {none, none, nan, none, none};
}

bool has_value(const LightValue& value) { return is_finite(value.irradiance) && is_finite(value.radiance); }

}  // namespace kiln
