#pragma once
// Where a certificate of a light field looks: at many places and eyes the file is asked, few of them are traced.
//
// Errors of a light field are rare and large where something bright is mirrored: on a helmet of polished metal one eye
// of 1500 has a third of the squared error, at a hundred times the mean light. And they are where an eye matters at
// all: a metal knot on a matt floor has all of them. So of many even views those are chosen with the chance
//   p_i = min(1, count q_i),   q_i ~ w_i (1 + b_i^2 / mean b^2 + c_i^2 / mean c^2 + d_i^2 / mean d^2)               (1)
// b: what the file shows, c: how far from it is what another eye, drawn at random, sees there, d: what a smooth surface
// mirrors of the sky if nothing is in the way; each chosen one stands for w_i / p_i even ones: sums are theirs in the
// mean.
//
// A lamp of a few texels of the sky is in one mirror of 100,000 even eyes, and may be most of the squared error. So
// half of the eyes are where a mirror would show a direction l drawn by the sky's light, and all together have the
// weights of
//   w = (1 / 2 pi) / (1/2 1 / 2 pi + 1/2 p_sky(l)),   l = 2 (n.v) n - v                                             (2)
// (Veach and Guibas 1995, the balance heuristic; a reflection keeps solid angles.)
// Method  systematic sampling in the order of the surface (stratified, none twice).
// Units   W m^-2 sr^-1.   Repeat  same views for any thread count

#include <cstdint>
#include <span>
#include <vector>

#include "core/artifact/baked_scene.h"
#include "core/base/threads.h"
#include "core/mesh/closest_point.h"
#include "core/scene/environment.h"

namespace kiln {

/// An eye above a place of the delivered surface, and the place of the input's surface that it should show.
struct FieldView {
  SurfaceMatch truth;  // nearest, with a compatible normal
  Vec3d normal, view;  // of the input there, unit; the view points to the eye
  Vec3d shown;         // by the file
  double change = 0;   // c of equation 1
  double mirror = 0;   // d of equation 1
  double weight = 1;   // even views that this one stands for
};

struct ManyViews {
  std::size_t count = 65536;
  std::uint64_t seed = 0;
};

/// Places even by area of the delivered surface, `weight` by equation 2: for sums those are eyes even over the half
/// space of the input's normal. Places where no surface of the input looks that way are left out. `sky` may be null.
std::vector<FieldView> many_views(const BakedScene& decoded, const Scene& input, const Environment* sky,
                                  const ManyViews&, Threads&);

/// About `count` of them, by equation 1; they have weights w / p.
std::vector<FieldView> choose_views(std::span<const FieldView> all, std::size_t count, std::uint64_t seed);

}  // namespace kiln
