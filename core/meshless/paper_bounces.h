#pragma once
// Reflected light by the paper's own scheme: bounce by bounce, with the basis evaluated wherever a ray lands.
//   i_0 = e,   i_{k+1} = T i_k,   r = i_1 + i_2 + ...     each the coefficients of a function (basis.h, equation 9) (1)
// Bounce  COMPUTE-BOUNCE gathers at all points of the coarsest level (and those that no coarser function reaches), then
// at the children of those that the oracle
//         asks for: points of the next level whose functions are not 0 there. A finer coefficient is a difference
//         (equation 10), so the points of all coarser functions that are not 0 at a point are gathered at before it.
// Oracle  RECEIVER-ORACLE asks for children on the coarsest level where light differs by more than eps from that of a
//         point whose function is not 0 there; on finer levels where the coefficient is larger than eps.
// Gather  cosine rays; where one lands the levels of i_k are summed up to the first whose functions there have a mean
//         solid angle below eps_solid_angle: of their balls, as seen from where the ray started.
// Series  ends when less than kTail of the light (radiosity.h) is left, or after kMostPaperBounces; what is left counts
//         as a geometric series of the last term. Where the number of bounces is given it is just those.
// Paper   Lehtinen et al. 2007, section 6.3.
// Groups  are those of cover.h: one more short ray where a ray lands.
// Differs eps is in parts of the mean light; rays are those of gather_rows.h, not one Hammersley set. As in the paper
//         nothing asks who sees whom: coarse functions reach through walls, and finer ones correct that where asked
//         for.
// Units   W m^-2 sr^-1: irradiance / pi.   Cost  kernels of about ten functions a level for each ray: most of the time
// Repeat  same bits for any thread count.   Fails  never; no points, no light

#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include "core/base/threads.h"
#include "core/meshless/basis.h"
#include "core/prt/gather_faces.h"
#include "core/prt/hit_albedo.h"
#include "core/prt/transfer_point.h"
#include "core/trace/tracer.h"

namespace kiln {

inline constexpr float kPaperSolidAngle = std::numbers::pi_v<float> / 10;  // the paper's eps_Omega, sr
inline constexpr int kMostPaperBounces = 64;

struct PaperBounces {
  int rays = 512;                            // of a gather; rounded up to a multiple of kPacket
  float eps = 0.04F;                         // the paper's eps_E, of the mean light
  float eps_solid_angle = kPaperSolidAngle;  // sr
  int bounces = -1;                          // -1: until the tail is below kTail
  std::uint64_t seed = 0;
};

struct PaperLight {
  std::vector<Vec3f> coefficients;  // of the reflected light r
  std::vector<char> gathered;       // of each point: whether any bounce gathered there
  std::uint64_t rays = 0;
  int bounces = 0;
  double tail = 0;  // share of the light in what the series had not reached
};

/// What rays meet.
struct PaperWorld {
  const Tracer& tracer;
  const GatherFaces& faces;
  const HitAlbedo& albedo;
  float cover = 0;  // of the points: places in gaps are a reconstruction group of their own (cover.h)
};

/// `points` and `direct`, their direct light, are those of the basis.
PaperLight bounce_on_basis(const PaperWorld&, const MeshlessBasis&, std::span<const TransferPoint> points,
                           std::span<const Vec3f> direct, const PaperBounces&, Threads&);

}  // namespace kiln
