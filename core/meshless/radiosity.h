#pragma once
// Radiosity at any places of a surface, solved on points that know nothing of the mesh.
//   b = e + T b,   b = irradiance / pi; radiance that leaves is albedo x b, emission beside it
// Paper   Lehtinen et al. 2007, section 6.3.   Differs  (scheme `rows`, which a trial found ten times faster)
//  - direct light is found where it is asked for (direct_light.h); only reflected light, which is smooth, lives on
//  points;
//  - T is traced once, as rows (gather_rows.h): a bounce is a sparse sweep and evaluates no basis;
//  - RECEIVER-ORACLE compares what one bounce gathers at a point with what coarser points predict there, and gathers at
//    the finer points around it where the difference is above `eps` times the mean light. The first levels are gathered
//    everywhere;
//  - reflected light is read, at places and at points that were not gathered, from the flattened set of gathered
//  points:
//    one level of the Shepard basis (basis.h), radii by k nearest neighbours of whatever density is there. What a
//    place reads is first turned to its normal (vector irradiance, VectorValue of gather_rows.h);
//  - places inside solids, and those that no function reaches, gather for themselves.
// `paper`: reflected light is solved by the scheme of the paper itself (paper_bounces.h) on the points that were
// placed,
//   and read as the basis has it at each place; direct light is found there all the same, as the paper advises.
// Bounces until what is left is below kTail of the light, by mixed sweeps (anderson.h); or as many as asked for.
// Units   W m^-2 sr^-1 (value = irradiance / pi: what a white vertex radiates)
// Cost    see README.md.   Memory  12 bytes a gathering ray until it is solved, about 300 a point
// Repeat  same bits for any thread count.   Fails  never on a valid Scene; Cancelled if stopped

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "core/base/threads.h"
#include "core/meshless/direct_light.h"
#include "core/meshless/lit_surface.h"
#include "core/meshless/points.h"
#include "core/scene/environment.h"
#include "core/trace/tracer.h"

namespace kiln {

struct Radiosity {
  PointPlacement points;
  DirectRays direct;
  int rays = 512;                   // of a gather
  int uniform_levels = 3;           // gathered everywhere; at least 1
  float eps = 0.02F;                // of the mean light: prediction error above which finer points are gathered
  int bounces = -1;                 // reflections; -1: until the tail is below kTail
  int neighbours = 10;              // of the flattened points around a vertex
  std::optional<float> paper = {};  // the paper's own scheme (paper_bounces.h), and its eps_solid_angle, sr
  bool vector = true;  // reflected light is turned to the normal where it is read; else it is read as it is
  std::uint64_t seed = 0;
  bool light_points = false;  // the light of the points themselves is asked for: ReflectedLight::point_light
  std::function<void(std::string_view stage)> stage = {};  // told as each begins: points, direct, gather, basis, sweeps
};

inline constexpr double kTail = 1e-4;  // of the light
inline constexpr int kMostSweeps = 1000;

struct RadiosityStats {
  std::uint64_t direct_rays = 0, gather_rays = 0;
  std::vector<std::uint32_t> points, gathered;  // on each level
  std::size_t alone = 0;                        // places that were asked for and gathered for themselves
  int sweeps = 0;
  double tail = 0;  // share of the light in reflections beyond the last, where their number is given and not 0
};

/// Reflected light of a place as it is read, and as two independent gathers at the place itself have it.
struct GatherProbe {
  Vec3f read, first, second;
  float spread = 1;  // the variance of `read`, of that of one gather: the sum of its squared weights
};

/// Reflected light of a scene: solved once, read at any place of the surface.
class ReflectedLight {
 public:
  /// Keeps references to the tracer and to `sky`, which may be null. `readers` are places that will be asked for, all
  /// or some: where they see no point, one is placed (demand.h).
  ReflectedLight(const Tracer&, const Environment* sky, const Radiosity&, std::span<const TransferPoint> readers,
                 Threads&);
  ReflectedLight(const ReflectedLight&) = delete;
  ReflectedLight& operator=(const ReflectedLight&) = delete;
  ~ReflectedLight();

  /// Of each place. Rays of those that gather for themselves count in stats().
  std::vector<Vec3f> at(std::span<const TransferPoint>, Threads&);
  /// None where nothing is reflected.
  std::vector<GatherProbe> probe(std::span<const TransferPoint>, Threads&);

  const RadiosityStats& stats() const;
  const PointHierarchy& points() const;
  /// All light of the points, direct light with as many rays as at vertices; where it was asked for.
  const std::vector<Vec3f>& point_light() const;
  /// With the light that one more reflection gathers: all of it, or that of bounces - 1 reflections where their number
  /// is given; null where that is 0.
  const LitSurface* surface() const;
  /// The same, taken out: nothing can be read any more.
  std::unique_ptr<LitSurface> take_surface();

 private:
  class Solver;
  std::unique_ptr<Solver> solver_;
};

struct RadiosityResult {
  std::vector<Vec3f> direct, indirect;  // of each vertex of the tracer's mesh
  std::unique_ptr<LitSurface> surface;  // of ReflectedLight
  RadiosityStats stats;
};

/// At the vertices of the tracer's mesh. `sky` may be null.
RadiosityResult solve_radiosity(const Tracer&, const Environment* sky, const Radiosity&, Threads&);

}  // namespace kiln
