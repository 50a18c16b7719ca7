#pragma once
// Lit meshes whose truth is known, and what must hold of every simplified one.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <utility>

#include "core/base/random.h"
#include "core/lightfield/lit_mesh.h"
#include "core/mesh/topology.h"

namespace kiln::testing {

inline const float kY0 = static_cast<float>(std::sqrt(1 / (4 * std::numbers::pi)));

using Colour = std::function<Vec3f(const Vec3f&)>;

inline Vec3f grey(const Vec3f&) { return {0.5F, 0.5F, 0.5F}; }

/// Constant radiance functions of degree `degree` by place.
inline void paint(LitMesh& lit, int degree, const Colour& colour) {
  lit.field = {.degree = degree, .coefficients = {}};
  lit.field.coefficients.resize(3 * lit.field.count() * lit.mesh.position.size());
  for (std::size_t v = 0; v < lit.mesh.position.size(); ++v) {
    const Vec3f rgb = colour(lit.mesh.position[v]);
    for (std::size_t c = 0; c < 3; ++c) lit.field.of(v)[c * lit.field.count()] = rgb[c] / kY0;
  }
}

inline Vec3f colour_at(const LitMesh& lit, std::size_t v) {
  const auto c = lit.field.of(v);
  const std::size_t n = lit.field.count();
  return Vec3f{c[0], c[n], c[2 * n]} * kY0;
}

/// n x n squares over [-0.5, 0.5]^2 at height z(x, y), facing +z.
inline LitMesh sheet(std::uint32_t n, const std::function<float(float, float)>& z, const Colour& colour = grey,
                     int degree = 0) {
  LitMesh lit;
  Mesh& m = lit.mesh;
  const auto across = static_cast<float>(n);
  for (std::uint32_t i = 0; i <= n; ++i) {
    for (std::uint32_t k = 0; k <= n; ++k) {
      const float x = static_cast<float>(k) / across - 0.5F, y = static_cast<float>(i) / across - 0.5F;
      m.position.push_back({x, y, z(x, y)});
    }
  }
  const auto at = [&](std::uint32_t i, std::uint32_t k) { return i * (n + 1) + k; };
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint32_t k = 0; k < n; ++k) {
      m.triangles.push_back({at(i, k), at(i, k + 1), at(i + 1, k + 1)});
      m.triangles.push_back({at(i, k), at(i + 1, k + 1), at(i + 1, k)});
    }
  }
  m.part.assign(m.triangles.size(), 0);
  m.normal.assign(m.position.size(), {});
  for (const Triangle& t : m.triangles)
    for (const std::uint32_t v : t) m.normal[v] += area_vector(m, t);
  for (Vec3f& normal : m.normal) normal = normalized(normal);
  paint(lit, degree, colour);
  return lit;
}

inline float flat(float, float) { return 0; }
inline float hills(float x, float y) { return 0.08F * std::sin(9 * x) * std::cos(7 * y); }

/// A sphere of radius 0.5: a cube's six n x n faces blown up, welded.
inline LitMesh sphere(std::uint32_t n, const Colour& colour = grey, int degree = 0) {
  LitMesh lit;
  Mesh& m = lit.mesh;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const float side : {-1.0F, 1.0F}) {
      const auto first = static_cast<std::uint32_t>(m.position.size());
      for (std::uint32_t i = 0; i <= n; ++i) {
        for (std::uint32_t k = 0; k <= n; ++k) {
          Vec3f p;
          p[axis] = side;
          p[(axis + (side > 0 ? 1 : 2)) % 3] = 2 * static_cast<float>(i) / static_cast<float>(n) - 1;
          p[(axis + (side > 0 ? 2 : 1)) % 3] = 2 * static_cast<float>(k) / static_cast<float>(n) - 1;
          m.position.push_back(normalized(p) * 0.5F);
        }
      }
      const auto at = [&](std::uint32_t i, std::uint32_t k) { return first + i * (n + 1) + k; };
      for (std::uint32_t i = 0; i < n; ++i) {
        for (std::uint32_t k = 0; k < n; ++k) {
          m.triangles.push_back({at(i, k), at(i + 1, k), at(i + 1, k + 1)});
          m.triangles.push_back({at(i, k), at(i + 1, k + 1), at(i, k + 1)});
        }
      }
    }
  }
  const std::vector<std::uint32_t> place = weld_by_position(m.position);
  for (Triangle& t : m.triangles)
    for (std::uint32_t& v : t) v = place[v];
  m.part.assign(m.triangles.size(), 0);
  for (const Vec3f& p : m.position) m.normal.push_back(normalized(p));
  paint(lit, degree, colour);
  drop_unused_vertices(lit);
  return lit;
}

/// Every triangle with three vertices of its own, and its own normal.
inline LitMesh flat_shaded(const LitMesh& lit) {
  LitMesh out{.mesh = {}, .field = {.degree = lit.field.degree, .coefficients = {}}};
  out.mesh.part = lit.mesh.part;
  for (const Triangle& t : lit.mesh.triangles) {
    Triangle own;
    for (std::size_t c = 0; c < 3; ++c) {
      own[c] = append_vertex(out, lit, t[c]);
      out.mesh.normal.back() = normalized(area_vector(lit.mesh, t));
    }
    out.mesh.triangles.push_back(own);
  }
  return out;
}

/// How often each directed edge between places occurs. A closed manifold has each once, and its opposite.
inline std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges_in_space(const Mesh& m) {
  const std::vector<std::uint32_t> place = weld_by_position(m.position);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> out;
  for (const Triangle& t : m.triangles)
    for (std::size_t c = 0; c < 3; ++c) ++out[{place[t[c]], place[t[(c + 1) % 3]]}];
  return out;
}

/// Edges in space with no opposite: the borders.
inline std::size_t border_edges(const Mesh& m) {
  const auto edges = edges_in_space(m);
  std::size_t n = 0;
  for (const auto& [edge, count] : edges) n += edges.contains({edge.second, edge.first}) ? 0 : 1;
  return n;
}

/// Vertices - edges + faces, by places.
inline long euler(const Mesh& m) {
  std::map<std::uint32_t, int> used;
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& [edge, count] : edges_in_space(m)) {
    used[edge.first] = used[edge.second] = 1;
    edges[std::minmax(edge.first, edge.second)] = 1;
  }
  return static_cast<long>(used.size()) - static_cast<long>(edges.size()) + static_cast<long>(m.triangles.size());
}

/// Sizes, indices, numbers and unit normals.
inline void expect_sound(const LitMesh& lit) {
  const Mesh& m = lit.mesh;
  const std::size_t n = m.position.size();
  ASSERT_EQ(m.normal.size(), n);
  ASSERT_EQ(lit.field.vertices(), n);
  ASSERT_EQ(m.part.size(), m.triangles.size());
  std::vector<bool> used(n);
  for (const Triangle& t : m.triangles) {
    for (const std::uint32_t v : t) {
      ASSERT_LT(v, n);
      used[v] = true;
    }
    EXPECT_TRUE(t[0] != t[1] && t[1] != t[2] && t[2] != t[0]);
  }
  for (std::size_t v = 0; v < n; ++v) {
    EXPECT_TRUE(used[v]);
    EXPECT_TRUE(is_finite(m.position[v]));
    const float norm = length(m.normal[v]);
    EXPECT_TRUE(norm == 0 || std::abs(norm - 1) < 1e-5F);
  }
  for (const float c : lit.field.coefficients) ASSERT_TRUE(std::isfinite(c));
}

}  // namespace kiln::testing
