#pragma once
// Radiosity at the vertices of a mesh and at any other places, solved on points that know nothing of the mesh.
//   b = e + T b,   b = irradiance / pi; radiance that leaves is albedo x b, emission beside it
// Paper   Lehtinen et al. 2007, section 6.3.   Differs  (scheme `rows`, which a trial found ten times faster)
//  - direct light is found at each vertex (direct_light.h); only reflected light, which is smooth, lives on points;
//  - T is traced once, as rows (gather_rows.h): a bounce is a sparse sweep and evaluates no basis;
//  - RECEIVER-ORACLE compares what one bounce gathers at a point with what coarser points predict there, and gathers at
//    the finer points around it where the difference is above `eps` times the mean light. The first levels are gathered
//    everywhere;
//  - reflected light is read at vertices and at points that were not gathered from the flattened set of gathered
//  points:
//    one level of the Shepard basis (basis.h), radii by k nearest neighbours of whatever density is there. What a
//    vertex reads is first turned to its normal (vector irradiance, VectorValue of gather_rows.h);
//  - vertices inside solids, and those that no function reaches, have rows of their own.
// `paper`: reflected light is solved by the scheme of the paper itself (paper_bounces.h) on the points that were
// placed,
//   and read as the basis has it at each vertex; direct light is found at vertices all the same, as the paper advises.
// Bounces until what is left is below kTail of the light, by mixed sweeps (anderson.h); or as many as asked for.
// Units   W m^-2 sr^-1 (value = irradiance / pi: what a white vertex radiates)
// Cost    see README.md.   Memory  12 bytes a gathering ray, about 200 a point and 100 a vertex or place
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
#include "core/prt/hidden.h"
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
  std::vector<Vec3f> known_direct = {};    // direct light of each vertex; empty: it is found
  std::vector<StandIn> stand_ins = {};     // where hidden vertices are lit instead; ascending (core/prt/hidden.h)
  std::vector<std::uint32_t> probes = {};  // vertices that gather twice besides, for GatherProbe; change nothing else
  std::vector<TransferPoint> places = {};  // to be lit as vertices are: texels of a lightmap
  bool light_points = false;  // the light of the points themselves is asked for: RadiosityResult::point_light
  std::function<void(std::string_view stage)> stage = {};  // told as each begins: points, direct, gather, basis, sweeps
};

inline constexpr double kTail = 1e-4;  // of the light
inline constexpr int kMostSweeps = 1000;

struct RadiosityStats {
  std::uint64_t direct_rays = 0, gather_rays = 0;
  std::vector<std::uint32_t> points, gathered;  // on each level
  std::size_t alone = 0;                        // vertices with rows of their own
  int sweeps = 0;
  double tail = 0;  // share of the light in reflections beyond the last, where their number is given and not 0
};

/// Reflected light of a vertex as it was read, and as two independent gathers at the vertex itself have it.
struct GatherProbe {
  Vec3f read, first, second;
  float spread = 1;  // the variance of `read`, of that of one gather: the sum of its squared weights
};

struct RadiosityResult {
  std::vector<Vec3f> direct, indirect;  // of each vertex of the tracer's mesh, then of each of `places`
  std::unique_ptr<LitSurface> surface;  // with the light that one more reflection gathers: all of it, or that of
                                        // bounces - 1 reflections where their number is given; null where that is 0
  std::vector<GatherProbe> probes;      // of params.probes; none where nothing is reflected
  PointHierarchy points;                // where the light of the points was asked for,
  std::vector<Vec3f> point_light;       // and all of that light, direct light with as many rays as at vertices
  RadiosityStats stats;
};

/// `sky` may be null.
RadiosityResult solve_radiosity(const Tracer&, const Environment* sky, const Radiosity&, Threads&);

}  // namespace kiln
