#pragma once
// Direct diffuse transfer: the light a white point re-emits, as a linear map of distant SH light.
//   t_i = 1/pi * integral over the sphere of V(w) max(n.w, 0) Y_i(w) dw                                    (1)
// Paper   [Krivanek04] section 2; conventions of core/sphere/sh.h.
// Shape   out[v * sh_count(order) + i]
// Units   dot(t, L) is exit radiance at albedo 1 for SH radiance L (W m^-2 sr^-1)
// Repeat  same bits for any thread count.      Fails  never on a valid Scene; Cancelled if stopped

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/threads.h"
#include "core/trace/tracer.h"

namespace kiln {

struct DirectTransfer {
  int order = 6;             // bands, 1..kMaxShOrder; coefficients = order^2
  int samples = 1024;        // rays per point, 1..65536; rounded up to a multiple of 16
  std::uint64_t seed = 0;
};

/// Where transfer is wanted: a vertex, or an edge midpoint that may become one.
struct TransferPoint {
  Vec3f position;  // unit-cube coordinates
  Vec3f normal;    // unit shading normal
  Vec3f inward;    // a point on an adjacent face towards which the ray origin is pulled by a hair, so that a vertex
                   // on a wall does not look through it (vertex_points fills it)
  Vec3f face_normal;
};

struct TransferStats {
  std::uint64_t rays = 0;
  std::uint64_t open_points = 0;  // points that took the closed form without a ray
};

/// A point for each vertex of the mesh.
std::vector<TransferPoint> vertex_points(const Mesh&);

class DirectTransferBaker;  // keeps direction sets and the open-point test; see direct_transfer.cpp

std::vector<float> bake_direct_transfer(const Tracer&, std::span<const TransferPoint>, const DirectTransfer&, Threads&,
                                        TransferStats* stats = nullptr);

}  // namespace kiln
