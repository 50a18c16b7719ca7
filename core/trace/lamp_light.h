#pragma once
// Light of lamps at the vertices of a path, looked for from both ends.
//
// Three ways lead from a vertex to a lamp: a shadow ray, the path's own ray where it ends on an emitter, and a beam: a
// ray that leaves a lamp, and where it ends or where it is reflected to is what the vertex before looks at. All are
// joined by the balance heuristic, which bounds each contribution by the best way.
// Why     beams find the spots that a lamp makes on surfaces near it. Paths hit those by chance only, and the light
//         found there has no finite variance: its square, 1 / r^4, has no mean over a surface.
// Paper   Veach and Guibas 1995 (bidirectional, with light paths of one and two segments).   Error  unbiased.
// Not for directional lights, which make no spots: no beams of theirs.

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/base/vec.h"
#include "core/trace/lights.h"
#include "core/trace/surface.h"
#include "core/trace/tracer.h"

namespace kiln {

/// A point on a surface that light arrives at, seen from the side of its normals.
struct PathVertex {
  Vec3d position, normal, face;
  // Per area, of the path's coming here by a cosine-distributed ray; where it began: infinite.
  double density = std::numeric_limits<double>::infinity();
  // The same against a beam that ends here: divided by 1 + q / p, where p is the density at the vertex before and q
  // that of a reflected beam's going there.
  double against_beams = std::numeric_limits<double>::infinity();
};

/// The vertex after `from`, at a place that it sees.
PathVertex vertex_after(const PathVertex& from, const Vec3d& position, const Vec3d& normal, const Vec3d& face);

/// Where a vertex's rays start, clear of its face.
Vec3f lifted(const PathVertex&);

class LampLight {
 public:
  /// Each of `lamps` is a lighting of its own; emitters and lights of the scene, if wanted, are one more, the last.
  /// Keeps a reference to the tracer and its scene.
  LampLight(const Tracer&, std::span<const Light> lamps, bool scene_lights);

  std::size_t lightings() const { return own_.size() + (scene_lights_ ? 1 : 0); }
  bool has_emitters() const { return scene_lights_ && !emitters_.empty(); }
  bool has_beams() const { return has_beams_; }
  std::uint64_t rays_per_vertex() const;

  /// Uniform in [0, 1).
  struct Draw {
    double pick = 0, emitter = 0;
    Vec2<double> place, direction, reflection;
  };

  /// Adds weight * irradiance / pi that shadow rays find, to sum[lighting]; `emitter` and `place` of the draw count.
  void add_direct(const PathVertex&, const Vec3d& weight, const Draw&, std::span<Vec3d> sum) const;
  /// The same, by one beam: light that is reflected once, where it ends, or twice, if `once` and `twice` count.
  void add_beam(const PathVertex&, const Vec3d& weight, const Draw&, bool once, bool twice, std::span<Vec3d> sum) const;
  /// The same of the emitter that the path's ray from the vertex along w met. `density` of that ray is per solid angle.
  void add_met(const PathVertex&, const Vec3d& w, double density, const Hit&, const SurfacePoint&, const Vec3d& weight,
               std::span<Vec3d> sum) const;

 private:
  struct Sender {
    const Light* light;  // nullptr: the emitters, last
    std::size_t lighting;
    double share;  // of the beams
  };
  struct Beam {
    Vec3d from, direction;
    EmitterSample emitter;
  };
  void choose_senders();
  const Sender& pick(double u) const;
  Beam draw_beam(const Sender&, const Draw&) const;
  Vec3d carried(const Sender&, const Beam&, const PathVertex& lit) const;
  static double density_of_beams(const Sender&, const LightArrival&, const PathVertex&);
  static Vec3d sent(const Sender&, const PathVertex&);
  Vec3d emitted(const EmitterSample&, const PathVertex&) const;
  Vec3d punctual(const Sender&, const PathVertex&) const;
  bool in_shadow(const PathVertex&, const Vec3d& lamp, const Vec3d& lamp_face) const;

  const Tracer& tracer_;
  const Scene& scene_;
  std::span<const Light> own_;
  bool scene_lights_;
  const EmitterSampler& emitters_;
  std::vector<Sender> senders_;
  bool has_beams_ = false;
};

}  // namespace kiln
