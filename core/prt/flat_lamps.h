#pragma once
// Direct light of flat lamps: the closed form of what a lamp sends, times the share of it that is visible.
//   value = L F V,  F = 1/(2 pi) | sum over the outline's edges of  angle_k (gamma_k . n) |               (Lambert)
//   V = sum of visible w_i / sum of w_i over stratified points of the lamp, w_i = cos cos' / d^2
// Where all `few` points of a lamp are visible, or none is, that is the answer: no noise in the open and none in full
// shadow. Elsewhere up to `many` points are asked, and V is a ratio estimate whose noise is that of visibility alone.
// The outline is first clipped by the receiver's horizon.
// Rounds  of `few`, as many again, twice as many ..., from the third on until estimates differ so little that the error
//         is likely below the tolerance, as of other lamps (lamps.h); without a tolerance `many` at once.
// Lamp    emitting triangles of one part and one plane, without texture or alpha; inner edges cancel out of Lambert's
//         sum and are dropped, so a lamp of 512 triangles has four edges.
// Points  stratified along the Morton curve over a lamp's triangles by area, and within a triangle.
// Units   irradiance / pi, W m^-2 sr^-1.   Repeat  a pure function of its arguments
// Error   consistent; a shadow of less than 1 / few of a lamp may be missed, and a sliver of a lamp above the horizon
//         that no point falls on (7e-4 of a white box at most, measured)

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/prt/lamps.h"
#include "core/sphere/sobol_points.h"
#include "core/trace/tracer.h"

namespace kiln {

/// Shadow rays for each lamp: `few` decide whether its visibility is mixed, then `many` in all, at most kMost.
struct LampRays {
  static constexpr int kMost = SobolPoints::kMost;
  int few = 32;
  int many = 128;
  float tolerance = 0;  // of irradiance / pi
};

class FlatLamps {
 public:
  /// Nothing when the scene has no emitters, some that are no flat lamps, or more than kMostLamps of them, or outlines
  /// of more than kMostEdges edges: then Lamps (core/prt/lamps.h) is the better way. Keeps a reference to the tracer.
  static std::optional<FlatLamps> find(const Tracer&);
  static constexpr std::size_t kMostLamps = 16, kMostEdges = 64;

  std::size_t count() const { return lamps_.size(); }
  /// Adds the rays that were sent to `rays`.
  Vec3f light_at(const Receiver&, const LampRays&, std::uint64_t seed, std::uint64_t& rays) const;

 private:
  struct Lamp {
    Vec3d radiance, normal, place;  // a point of its plane
    bool double_sided = false;
    std::vector<std::vector<Vec3d>> outline;  // corners of closed loops; holes turn the other way
    std::vector<std::uint32_t> triangles;     // along the Morton curve
    std::vector<double> area;                 // up to and with each
  };
  struct Sums {
    double all = 0, visible = 0;
    bool seen = false, hidden = false;  // some point of the lamp is
  };
  explicit FlatLamps(const Tracer& tracer) : tracer_(&tracer) {}
  bool outline_of(Lamp&) const;
  Vec3d point_of(const Lamp&, const Vec2f& u) const;
  void add_points(const Lamp&, const Receiver&, int first, int last, const SobolPoints&, Sums&) const;
  double visible_share(const Lamp&, const Receiver&, const LampRays&, std::uint64_t seed, std::uint64_t& rays) const;

  const Tracer* tracer_;
  std::vector<Lamp> lamps_;
};

/// Lambert's F of a closed loop of corners seen from `at`, clipped to what lies above the horizon of n. Its sign is the
/// sense of rotation: loops of an outline and its holes add up.
double loop_form_factor(std::span<const Vec3d> loop, const Vec3d& at, const Vec3d& n);

}  // namespace kiln
