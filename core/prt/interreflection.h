#pragma once
// Diffuse interreflection in RGB: Neumann series gathered over the vertices of the mesh.
//   T_0 = D,   T_{k+1} = D + K T_k,   (K T)(x) = 1/pi * integral of rho(y) T(y) (n.w) dw,  y = first hit along w
// After `bounces` passes T holds exactly the light of up to that many reflections.
// Shape   in: D[v * slots + i] grey (slots = order^2, one more when `fixed`; the fixed slot is RGB and given apart)
//         out: Transfer with 3 channels
// Memory  at most 600 bytes per vertex at order 6, all told (anchor of issue 2)

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/base/threads.h"
#include "core/prt/direct_transfer.h"
#include "core/prt/gather_faces.h"
#include "core/prt/hidden.h"
#include "core/prt/transfer.h"
#include "core/trace/tracer.h"

namespace kiln {

struct Interreflection {
  int order = 6;
  int bounces = 1;    // passes, >= 0
  int samples = 256;  // most closest-hit rays per vertex in each of the last two passes; a quarter of them before.
                      // Vertices of little surface take as few as a quarter
  std::uint64_t seed = 0;
  std::vector<StandIn> stand_ins = {};     // where hidden vertices gather instead; ascending
  std::vector<std::uint32_t> probes = {};  // vertices whose last pass is done twice, to see its noise
  std::function<void(std::uint64_t done, std::uint64_t all)> progress = {};  // rays of a vertex, told after each pass
};

/// Reflected light at probes in two independent draws of the last pass: the second minus the first.
/// Shape   difference[probe * 3 * slots + c * slots + i], always RGB; nothing when bounces = 0
struct ProbeNoise {
  std::vector<float> difference;
};

/// Rays that all passes send from a vertex of much surface.
std::uint64_t rays_per_vertex(const Interreflection&);

/// `direct` has sh_count(order) values per vertex; `fixed_direct` is empty or one RGB per vertex (direct light of the
/// scene's lamps). Called with bounces = 0 it only joins the two. Vertices are those of tracer.scene().mesh or of a
/// refinement of it: `mesh` names the vertices, and must have the tracer's surface.
Transfer bake_interreflection(const Tracer&, const Mesh& mesh, std::vector<float> direct,
                              std::vector<Vec3f> fixed_direct, const Interreflection&, Threads&,
                              TransferStats* stats = nullptr, ProbeNoise* noise = nullptr);

/// 1 where no colour can come into reflected light, else 3. `fixed_direct`: of vertices and other points.
int transfer_channels(const GatherFaces&, const Scene&, const std::vector<Vec3f>& fixed_direct);

/// Under a constant sky of 1 nothing is brighter than 1. Open sky and hits are counted with different rays, and direct
/// light may be fitted (fit_vertices.h): a vector with more than there is shrinks to it, each channel as a whole; the
/// fixed slots stay. `row` has `shape`'s stride.
void limit_transfer(const Transfer& shape, float* row);

/// Direct light of emitters and punctual lights at points: irradiance / pi, RGB.
struct FixedDirect {
  int samples = 256;  // shadow rays per point over all emitters; one per punctual light besides
  std::uint64_t seed = 0;
  int reach = 1;        // at most so many times as many where the error is likely above the tolerance (lamps.h)
  float tolerance = 0;  // of the value
};
std::vector<Vec3f> bake_fixed_direct(const Tracer&, std::span<const TransferPoint>, const FixedDirect&, Threads&,
                                     TransferStats* stats = nullptr);

}  // namespace kiln
