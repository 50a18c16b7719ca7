#pragma once
// Diffuse interreflection of transfer vectors, solved on points that know nothing of the mesh.
//   T_0 = D,   T_{k+1} = D + K T_k,   (K T)(x) = 1/pi * integral of rho(y) T(y) (n.w) dw,  y = first hit along w   (1)
// After `bounces` sweeps T holds exactly the light of up to that many reflections, as in core/prt/interreflection.h.
// Paper   Lehtinen et al. 2007, sections 6.3 and 6.4: reflections by the basis itself, each function a vector.
// How     as radiosity.h: direct light is known at the vertices and found by fewer rays at the points; K is traced
// once,
//         as rows (gather_rows.h), and a reflection is a sparse sweep over them; finer points are gathered at where one
//         reflection is not what coarser ones predict (adaptive_points.h), `eps` of the mean light under any one
//         lighting; vertices read the points that they see (surface_reading.h), turned to their own normals.
// Left out  the sky's light on places that no point stands for, where a path leads on (sender_paths.h).
// Shape   as bake_interreflection.   Memory  12 bytes a gathering ray; of each point 4 bytes a number of its vector,
//         four times over where it is gathered at
// Repeat  same bits for any thread count.   Fails  never on a valid Scene; Cancelled if stopped

#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

#include "core/base/threads.h"
#include "core/meshless/points.h"
#include "core/prt/direct_transfer.h"
#include "core/prt/hidden.h"
#include "core/prt/interreflection.h"
#include "core/prt/transfer.h"
#include "core/trace/tracer.h"

namespace kiln {

struct TransferSweeps {
  int bounces = 1;  // reflections, at least 1
  PointPlacement points = {};
  DirectTransfer sky = {};  // of the points; its order is that of all, band_power is set
  FixedDirect lamps = {};   // of the points
  int rays = 256;           // of a gather
  int uniform_levels = 3;   // gathered at everywhere
  float eps = 0.02F;        // of the mean light
  int neighbours = 10;      // of the points around a vertex
  std::uint64_t seed = 0;
  std::vector<StandIn> stand_ins = {};                     // where hidden vertices are lit instead; ascending
  std::vector<std::uint32_t> probes = {};                  // vertices whose reflected light is drawn twice
  std::function<void(std::string_view stage)> stage = {};  // told as each begins: points, direct, gather, basis, sweeps
};

struct TransferSweepStats {
  std::uint64_t direct_rays = 0, gather_rays = 0;
  std::vector<std::uint32_t> points, gathered;  // on each level; points that were asked for are a last one
  std::size_t alone = 0;                        // vertices with rows of their own
};

struct SweptTransfer {
  Transfer transfer;
  ProbeNoise noise;
  TransferSweepStats stats;
};

/// `direct` and `fixed_direct` of the vertices of the tracer's mesh, as bake_interreflection takes them.
SweptTransfer sweep_transfer(const Tracer&, const std::vector<float>& direct, const std::vector<Vec3f>& fixed_direct,
                             const TransferSweeps&, Threads&);

}  // namespace kiln
