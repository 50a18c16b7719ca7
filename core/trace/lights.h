#pragma once
// The scene's own lamps, as an estimator samples them: punctual lights exactly, emissive triangles by area.
//
// Units   W, m and sr with lengths of the unit cube (see Light).   Repeat  a pure function of its arguments.

#include <cstdint>
#include <vector>

#include "core/base/vec.h"
#include "core/scene/scene.h"

namespace kiln {

/// What a punctual light sends to a point, unshadowed.
struct LightArrival {
  Vec3d direction;      // towards the light, unit
  double distance = 0;  // infinite for directional lights
  Vec3d irradiance;     // of a plane that faces the light; 0 out of range or cone
};

/// KHR_lights_punctual: inverse square, the window (1 - (d / range)^4) where there is a range, and the squared linear
/// ramp between the cosines of outer and inner cone.
LightArrival light_arrival(const Light&, const Vec3d& point);

/// The directions in which a point or spot light shines, evenly: one of them (not of unit length to the last bit), and
/// its density per solid angle.
Vec3d beam_direction(const Light&, const Vec2<double>& u);
double beam_density(const Light&, const Vec3d& from_light);

/// A point of an emitter.
struct EmitterSample {
  Vec3d position, normal;  // front side of the face
  Vec3d radiance;          // 0 where an alpha mask cuts the face away
  bool double_sided = false;
  double density = 0;  // of this point, per area
};

/// Emissive triangles, chosen by area times the strength of their material's emission factor, times how bright its
/// texture is there (core/trace/brightness_table.h: no texel is missed), and points uniform on them.
class EmitterSampler {
 public:
  /// Keeps a reference to the scene.
  explicit EmitterSampler(const Scene&);

  bool empty() const { return triangles_.empty(); }
  /// Those that emit, ascending.
  const std::vector<std::uint32_t>& triangles() const { return triangles_; }
  /// Sum over the emitters of area times strength: red, green and blue of the emission, about its mean.
  double total_strength() const { return total_; }
  /// `pick` and `u` are uniform in [0, 1). Not for an empty sampler.
  EmitterSample sample(double pick, const Vec2<double>& u) const;
  /// EmitterSample::density of points on a triangle of the scene; 0 where it does not emit.
  double density(std::uint32_t triangle) const;

 private:
  const Scene& scene_;
  std::vector<std::uint32_t> triangles_;
  std::vector<double> cumulative_;
  std::vector<float> strength_;  // of each triangle of the mesh; empty without emitters
  double total_ = 0;
};

}  // namespace kiln
