#pragma once
// Functions on surfaces from scattered points: the multilevel Shepard basis, without any mesh.
//   w_j(p) = K(|x - x_j| / r_j) max(0, n . n_j),   K(r) = 2 r^3 - 3 r^2 + 1 up to r = 1, then 0          (12, 13)
//   B_j(p) = w_j(p) / (sum of w_k(p) over the points k of the same level)                                 (4, 8)
//   F(p)   = sum_j a_j B_j(p),   a_j = f_j - F_coarser(p_j)                                               (9, 10)
// Paper   Lehtinen et al. 2007, section 4. r_j is the distance to the k-th nearest compatible point of j's level.
// Settled Points are compatible when they are of one group and their normals less than 90 degrees apart. Fewer than k
//         of them: the function reaches over the whole scene. Where no function of the levels so far reaches, the
//         nearest compatible point of the level counts alone (B = 1): never a division by zero. On a level above one
//         that was found, a hole is no detail (no term). Where no level has a compatible point F is 0.
// Cost    a look-up visits about k functions a level.   Repeat  same bits for any thread count

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/threads.h"
#include "core/meshless/points.h"
#include "core/meshless/sphere_tree.h"

namespace kiln {

/// The value of one basis function at a place.
struct BasisTerm {
  std::uint32_t function = 0;  // index of its point
  float value = 0;
};

/// What a place was given: nothing, the nearest compatible point for want of anything better, or basis functions.
enum class Cover : std::uint8_t { none, nearest, functions };

/// K of equation 13.
inline float falloff(float r) { return r < 1 ? (2 * r - 3) * r * r + 1 : 0.0F; }

class MeshlessBasis {
 public:
  static constexpr int kNeighbours = 10;

  /// Points level by level, as in PointHierarchy. `neighbours` is the paper's k.
  MeshlessBasis(std::span<const SurfaceSite> points, std::span<const std::uint32_t> level_end, Threads&,
                int neighbours = kNeighbours);

  std::size_t levels() const { return levels_.size(); }
  std::size_t functions() const { return sites_.size(); }
  std::uint32_t level_end(std::size_t level) const { return levels_[level].end; }
  std::size_t level_of(std::uint32_t function) const;
  float radius(std::uint32_t function) const { return radius_[function]; }
  const SurfaceSite& site(std::uint32_t function) const { return sites_[function]; }

  /// Appends the functions of the first `levels` levels that are not 0 at p; those of one level add up to 1.
  /// Cover::none, and nothing appended, where no level has a compatible point.
  Cover terms(const SurfaceSite& p, std::size_t levels, std::vector<BasisTerm>& out) const;

  /// Appends those of one level that are not 0 at p; false where there are none.
  bool terms_of(std::size_t level, const SurfaceSite& p, std::vector<BasisTerm>& out) const;

  /// Equation 9 over the first `levels` levels.
  Vec3f evaluate(std::span<const Vec3f> coefficients, const SurfaceSite& p, std::size_t levels) const;

  /// Equation 10: the coefficients of the function with values f_j at the points.
  std::vector<Vec3f> coefficients(std::span<const Vec3f> values, Threads&) const;

  /// The nearest compatible point of a level, or kNoFunction.
  static constexpr std::uint32_t kNoFunction = 0xffffffffU;
  std::uint32_t nearest(const SurfaceSite& p, std::size_t level) const;

 private:
  struct Level {
    std::uint32_t begin = 0, end = 0;
    SphereTree tree;
  };
  bool level_terms(const Level&, const SurfaceSite& p, std::vector<BasisTerm>& out) const;
  std::uint32_t nearest_of(const Level&, const SurfaceSite& p) const;

  std::vector<SurfaceSite> sites_;
  std::vector<float> radius_;
  std::vector<Level> levels_;
};

}  // namespace kiln
