#pragma once
// Direct-to-indirect transport: what a light that moves after the bake does by reflection, from links made before it.
//   e_s = mean over the samples of sender s of direct irradiance / pi                                               (1)
//   x_s = e_s, and on a node of the tree  x_n = sum over its children of share x_child                              (2)
//   (T x)_r = sum over the links of row r of value x[node]                                                          (3)
//   x = e + T x, `sweeps` times from x = e, then x += tail (x - x before the last sweep)                            (4)
//   reflected(r, n') = max(0, sum over the links of r of value (1 + n' . aside) x[node])                            (5)
// Rows 0 .. senders - 1 are those of the senders themselves, the others are the receivers that vertices read. Aside is
// at right angles to the row's own normal: read with that, (5) is (3). Paper   Lehtinen et al. 2007, section 6.5.
// Differs  the paper stores powers of T. One power of T is sparse, the sum
//         of all is not: so T alone is stored, and its powers are applied one after the other, among the senders only.
// Stored  as delivered: value = scale of the row x value / 255, where what rounding leaves over is carried from link to
//         link, so that a row's sum is right to half a step; aside = aside / 16; share = share / sum over its children.
// Units   value = irradiance / pi, W m^-2 sr^-1; lengths of the unit cube.
// Cost    links x (sweeps for the senders' share) x 3 products, and 9 for (5).   Repeat  same bits for any thread count

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/base/threads.h"
#include "core/base/vec.h"
#include "core/meshless/gather_rows.h"
#include "core/trace/lights.h"
#include "core/trace/tracer.h"

namespace kiln {

struct LightLink {
  std::uint16_t node = 0;
  std::array<std::uint8_t, 3> value{};  // of 255, times the row's scale
  std::array<std::int8_t, 3> aside{};   // of 16, world axes
  friend bool operator==(const LightLink&, const LightLink&) = default;
};

struct SenderSample {
  Vec3f position;
  std::array<std::int8_t, 3> normal{};  // of 127, not unit
  std::uint8_t zero = 0;
};

struct TreeChild {
  std::uint16_t node = 0, share = 0;
};

struct RowSite {
  Vec3f position;
  std::array<std::int8_t, 3> normal{};  // of 127
  std::uint8_t level = 0;               // kLone: of no level: a vertex that gathers for itself
  static constexpr std::uint8_t kLone = 255;
};

/// How the vertices of a mesh read rows: value = sum of weight / 255 x reflected(row, normal of the vertex).
struct RowTerm {
  std::uint32_t row = 0;
  std::uint8_t weight = 0;
};

struct LightLinks {
  std::uint32_t senders = 0;                // leaves: nodes 0 .. senders - 1
  std::vector<std::uint32_t> sample_begin;  // of each sender, and the end
  std::vector<SenderSample> samples;
  std::vector<std::uint32_t> child_begin;  // of nodes senders, senders + 1, ...; children come before their parents
  std::vector<TreeChild> children;
  std::vector<RowSite> sites;             // of each row
  std::vector<float> scale;               // of each row
  std::vector<std::uint32_t> link_begin;  // of each row, and the end
  std::vector<LightLink> links;
  std::vector<std::uint32_t> term_begin;  // of each vertex, and the end
  std::vector<RowTerm> terms;
  std::uint32_t sweeps = 0;
  float tail = 0;

  std::size_t rows() const { return scale.size(); }
  std::size_t nodes() const { return senders + (child_begin.empty() ? 0 : child_begin.size() - 1); }
  std::size_t vertices() const { return term_begin.empty() ? 0 : term_begin.size() - 1; }
  /// Links over rows x senders.
  double share_of_possible() const;
};

inline constexpr std::size_t kMostNodes = 65536;

/// Equation 1, unshadowed where `seen` says that a sample sees the light. `light` in lengths of the unit cube.
std::vector<Vec3f> light_senders(const LightLinks&, const Light& light, const Tracer&, Threads&);

/// Equations 2 to 4: all light at senders and nodes.
std::vector<Vec3f> solve_nodes(const LightLinks&, std::span<const Vec3f> direct);

/// Equation 5 before the normal comes in, at every row.
std::vector<VectorValue> gather_links(const LightLinks&, std::span<const Vec3f> nodes, Threads&);

/// What the vertices read; `normals` of each.
std::vector<Vec3f> read_rows(const LightLinks&, std::span<const VectorValue>, std::span<const Vec3f> normals, Threads&);

/// All of it: reflected light at the vertices.
std::vector<Vec3f> reflected_light(const LightLinks&, const Light&, const Tracer&, std::span<const Vec3f> normals,
                                   Threads&);

/// Direct irradiance / pi of one light, unshadowed points black.
Vec3f direct_of(const Light&, const Tracer&, const Vec3f& origin, const Vec3f& place, const Vec3f& normal);

std::array<std::int8_t, 3> pack_normal(const Vec3f&);
inline Vec3f unpack_normal(const std::array<std::int8_t, 3>& n) {
  return normalized(Vec3f{static_cast<float>(n[0]), static_cast<float>(n[1]), static_cast<float>(n[2])});
}

}  // namespace kiln
