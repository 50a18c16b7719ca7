#pragma once
// One transfer matrix (glossy_transfer.h), from closest-hit rays over the half space of a point's normal.
//   M[o][i] = integral over the half space of Y_o(w) (V(w) Y_i(w) + (1 - V(w)) rho(y) T_i(y)) dw,
//   y = hit along w                                                                                               (1)
// T(y) is the diffuse transfer vector of the surface that is hit; the lamps' column takes what y emits and its lamp
// light. Summed in the frame of the normal and turned into world axes at the end.
// Rays    in sets that all points share (uniform over the half space, stratified), azimuth by hash. The open part is
//         the closed form minus the rays that hit; a point that nothing rises above takes no ray.
// Repeat  same bits for any thread count: a matrix is a function of the point.
// Left out  light from the backs of double-sided faces counts as dark: no vertex holds it.

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/base/threads.h"
#include "core/prt/transfer.h"
#include "core/prt/transfer_point.h"
#include "core/trace/tracer.h"

namespace kiln {

struct GlossyMatrix {
  int order = 5;           // 1 .. kMaxShOrder, not above that of the transfer vectors
  int channels = 3;        // 1 only where no surface, lamp or lamp light has a hue
  bool fixed = false;      // the lamps' column; the transfer vectors have theirs
  bool reflected = false;  // light from the surfaces that are hit; else they are black but for what they emit
  int samples = 512;       // rays, rounded up to a multiple of 16
  std::uint64_t seed = 0;
};

/// The same matrices from rays of their own.
GlossyMatrix another_draw(const GlossyMatrix&);

/// For many points of one scene. `light` belongs to the vertices of tracer.scene().mesh.
class GlossyMatrixBaker {
 public:
  /// Keeps references to the tracer and the transfer, which must outlive it.
  GlossyMatrixBaker(const Tracer&, const Transfer& light, const GlossyMatrix&);
  ~GlossyMatrixBaker();

  /// Numbers of a matrix: channels x order^2 x (order^2 + fixed), shaped as a row of GlossyTransfer.
  std::size_t stride() const;
  /// Returns the rays it took.
  std::uint64_t bake(const TransferPoint&, float* out) const;
  /// Matrices of many points, one after the other. Adds the rays to `rays`.
  std::vector<float> bake(std::span<const TransferPoint>, Threads&, std::uint64_t& rays) const;
  /// The matrix of a point with this normal that nothing rises above.
  void open(const Vec3f& normal, float* out) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kiln
