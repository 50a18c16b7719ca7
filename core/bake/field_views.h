#pragma once
// Where a certificate of a light field looks: at many places and eyes the file is asked, few of them are traced.
//
// Errors of a light field are rare and large where something bright is mirrored: on a helmet of polished metal one eye
// of 1500 has a third of the squared error, at a hundred times the mean light. What is shown tells where such eyes are.
// So of many even views those are chosen with the chance
//   p_i = min(1, count q_i),   q_i ~ 1 + b_i / mean b + b_i^2 / mean b^2,   b: what the file shows                 (1)
// and each chosen one stands for 1 / p_i of them: sums are those of all views in the mean.
// Method  systematic sampling in the order of the surface (stratified, none twice).
// Units   brightness in W m^-2 sr^-1, the mean of the channels.   Repeat  same views for any thread count

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
  double weight = 1;   // views that this one stands for
};

/// Even by area of the delivered surface, each eye even over the half space of the input's normal. Places where no
/// surface of the input looks that way are left out.
std::vector<FieldView> even_views(const BakedScene& decoded, const Mesh& input, std::size_t count, std::uint64_t seed,
                                  Threads&);

/// About `count` of them, by equation 1.
std::vector<FieldView> choose_views(std::span<const FieldView> all, std::size_t count, std::uint64_t seed);

}  // namespace kiln
