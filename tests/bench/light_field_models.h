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

/// A bright sun, a lamp, a blue zenith and a warm ground; and its SH of order kMaxShOrder, R then G then B.
Vec3f sky_radiance(const Vec3d& w);
std::vector<float> sample_sky();

/// Radiance at every vertex. blur: h_l = exp(-blur l (l + 1)).
LightField paint_light(const Mesh&, int degree, double blur, const std::function<Paint(const Vec3f&)>& paint);

/// A torus with relief of many scales: n x 2 n vertices, closed, smooth normals, in the unit cube.
Mesh relief_torus(std::uint32_t n);
/// A sphere of 6 n x n squares, in the unit cube.
Mesh cube_sphere(std::uint32_t n);
/// A model of the shared folder, welded, with normals of its own or smooth ones.
Mesh load_model(const std::string& path);

struct Coat {
  double roughness = 0.3;
  Vec3f f0{0.04F, 0.04F, 0.04F};  // of glTF's GGX lobe
  Vec3f albedo;                   // of the diffuse layer below
};
/// Radiance of two materials under that sky with the surface's own shadows, mixed by the share of the second.
LightField shine(const Mesh&, int degree, const Coat&, const Coat&, const std::function<float(const Vec3f&)>& share,
                 Threads&);

/// Diffuse light of the sample sky with its shadows, at albedo 1: constant radiance functions, traced.
LightField bake_colours(const Mesh&, Threads&);

/// Smooth noise in [0, 1] with features of size `scale`.
float noise(const Vec3f& p, float scale);

}  // namespace kiln::bench
