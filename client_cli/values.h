#pragma once
// Points on surfaces, and light at them: the CSV that points, eval, reference and compare pass to each other.
//
//   x,y,z,nx,ny,nz[,vx,vy,vz]                                              points: world position, normal, view
//   x,y,z,nx,ny,nz[,vx,vy,vz],irradiance_r,_g,_b,radiance_r,_g,_b,distance   values of eval
//   ... ,irradiance_se_r,_g,_b,radiance_se_r,_g,_b                         and of reference: standard errors
// irradiance is W m^-2; radiance W m^-2 sr^-1; distance is how far the point lay from the surface, in world units.
// A point without a surface of compatible normal has nan in every value (null in JSON).

#include <optional>
#include <string>
#include <vector>

#include "client_cli/failure.h"
#include "core/base/vec.h"

namespace kiln {

struct QueryPoint {
  Vec3d position, normal;     // world; the normal need not be unit
  std::optional<Vec3d> view;  // towards an eye, not zero: with --albedo scene radiance is what it sees
};

struct LightValue {
  Vec3d irradiance, radiance;
  double distance = 0;
  Vec3d irradiance_error, radiance_error;  // standard errors
};

struct ValueTable {
  std::vector<QueryPoint> points;
  std::vector<LightValue> values;  // same size
  bool has_errors = false;         // the standard errors are there
};

Outcome<std::vector<QueryPoint>> read_points(const std::string& path);
std::string points_csv(const std::vector<QueryPoint>&);

Outcome<ValueTable> read_values(const std::string& path);
std::string values_csv(const ValueTable&);
/// An array with one object for each point; rgb triples as arrays.
std::string values_json(const ValueTable&);
std::string points_json(const std::vector<QueryPoint>&);

/// The value of a point that has none.
LightValue no_value();
bool has_value(const LightValue&);

}  // namespace kiln
