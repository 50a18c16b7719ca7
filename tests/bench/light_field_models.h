#pragma once
// Lit surfaces whose light is known in closed form, for tests/bench/light_field.cpp.
//   L~(p, w) = albedo(p) E(n) / pi + gloss(p) sum over l of h_l S_lm Y_lm(w)
// for a sky S, blurred by h as a rough mirror blurs it: distant light, nothing shadowed.

#include <functional>
#include <string>

#include "core/base/threads.h"
#include "core/lightfield/lit_mesh.h"

namespace kiln::bench {

struct Paint {
  Vec3f albedo;
  float gloss = 0;
};

/// SH coefficients of a bright sun, a blue zenith and a warm ground, order kMaxShOrder, R then G then B.
std::vector<float> sample_sky();

/// Radiance at every vertex. blur: h_l = exp(-blur l (l + 1)).
LightField paint_light(const Mesh&, int degree, double blur, const std::function<Paint(const Vec3f&)>& paint);

/// A torus with relief of many scales: n x 2 n vertices, closed, smooth normals, in the unit cube.
Mesh relief_torus(std::uint32_t n);
/// A sphere of 6 n x n squares, in the unit cube.
Mesh cube_sphere(std::uint32_t n);
/// A model of the shared folder, welded, with normals of its own or smooth ones.
Mesh load_model(const std::string& path);

/// Diffuse light of the sample sky with its shadows, at albedo 1: constant radiance functions, traced.
LightField bake_colours(const Mesh&, Threads&);

/// How far one lit mesh is from another of the same shape, at random points of `truth` and the nearest of `found`.
struct LightFieldError {
  double light = 0;     // sqrt(mean d^2 / mean |L|^2), d of eq. 5 between interpolated r-RFs, at the nearest places
  double distance = 0;  // RMS both ways, % of the diagonal of the box
};
LightFieldError compare(const LitMesh& truth, const LitMesh& found, Threads&);

/// Smooth noise in [0, 1] with features of size `scale`.
float noise(const Vec3f& p, float scale);

}  // namespace kiln::bench
