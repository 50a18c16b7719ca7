#pragma once
// Where a certificate of a light field looks: at many places and eyes the file is asked, few of them are traced.
//
// Errors of a light field are rare and large where something bright is mirrored: on a helmet of polished metal one eye
// of 1500 has a third of the squared error, at a hundred times the mean light. And they are where an eye matters at
// all: a metal knot on a matt floor has all of them. So of many even views those are chosen with the chance
//   p_i = min(1, count q_i),   q_i ~ 1 + b_i^2 / mean b^2 + c_i^2 / mean c^2                                        (1)
// b: what the file shows, c: how far from it is what another eye, drawn at random, sees there;
// each chosen one stands for 1 / p_i of them: sums are those of all views in the mean.
// Method  systematic sampling in the order of the surface (stratified, none twice).
// Units   W m^-2 sr^-1.   Repeat  same views for any thread count

#include <cstdint>
#include <span>
#include <vector>

#include "core/artifact/baked_scene.h"
#include "core/base/threads.h"
#include "core/mesh/closest_point.h"

namespace kiln {

/// An eye above a place of the delivered surface, and the place of the input's surface that it should show.
struct FieldView {
  SurfaceMatch truth;  // nearest, with a compatible normal
  Vec3d normal, view;  // of the input there, unit; the view points to the eye
  Vec3d shown;         // by the file
  double change = 0;   // c of equation 1
  double weight = 1;   // views that this one stands for
};

/// Even by area of the delivered surface, each eye even over the half space of the input's normal. Places where no
/// surface of the input looks that way are left out.
std::vector<FieldView> even_views(const BakedScene& decoded, const Mesh& input, std::size_t count, std::uint64_t seed,
                                  Threads&);

/// About `count` of them, by equation 1.
std::vector<FieldView> choose_views(std::span<const FieldView> all, std::size_t count, std::uint64_t seed);

}  // namespace kiln
