#pragma once
// What an edge collapse costs: the change of the light that leaves the surface, and of its shape.
//   E = sum over changed triangles t of area(t) d^2(L(p0), L_t(p0))                                                 (7)
//     + sum over seams (p, x) of a point that moves of area(p, p', x) d^2(L on one side of it, L on the other) (7a)
//   Q = sum over triangles around the edge of area x squared distance from their planes, and borders as lines
//   cost = (geometry_weight Q / u^2 + (1 - geometry_weight) E / mean |L|^2) / area of the surface
// L_t(p0) is extrapolated (4): weights of t's corners that sum to one. So d^2 is a quadratic form in those weights
// whose matrix holds the products of the differences between p0's neighbours and p0 on p0's hemisphere. That Gram
// matrix is kept for each vertex; a candidate then costs no integral at all, whatever the degree.
// Where the field keeps the sky apart, differences of normals times the sky's slope (light_field.h) belong to them.
// So do differences of texture coordinates, as lengths on the surface: a texture that slides counts as a surface that
// moves as far, geometry_weight and u included.
// Both are memoryless: of the mesh as it is now.
// Paper    Vanhoey et al. 2015, section 4; Hoppe 1999 (memoryless quadrics)
// Units    cost is a share of a squared relative error; u is kLengthUnit of the diagonal of the mesh's box
// Differs  the paper leaves the scales of light and length to the user: here they are the field's mean square and u.
//          Its edge collapse takes the optimal place; here the two ends may be cheaper

#include <cstdint>
#include <vector>

#include "core/lightfield/collapse_mesh.h"
#include "core/lightfield/field_products.h"
#include "core/mesh/quadric.h"

namespace kiln {

enum class Collapse { edge, half_edge };

struct CollapsePlan {
  bool possible = false;
  double cost = 0, order = 0;        // order: cost, and a little for long edges where nothing costs anything
  std::uint32_t gone = 0, kept = 0;  // points
  Vec3f place;
  float share = 1;     // of kept in the new vertex
  bool moves = false;  // else kept stays as it is
  EdgeSides sides;     // from gone to kept
};

class CollapseCost {
 public:
  /// `mean_square` is |L|^2 of the light that errors are relative to; 0: the mean of the field's own.
  CollapseCost(const CollapseMesh&, double geometry_weight, Collapse, double mean_square = 0);

  /// To be called once for all, and again for what a collapse changed. Calls for different points or vertices may run
  /// at the same time.
  void update_point(std::uint32_t p);
  void update_vertex(std::uint32_t v);

  /// The cheapest collapse of the edge between two points that kinds allow. Topology and shape are not asked.
  CollapsePlan plan(std::uint32_t p, std::uint32_t q) const;

 private:
  struct Gram {
    std::vector<std::uint32_t> ring;  // neighbours of a vertex
    std::vector<float> product;       // of neighbours i >= k: i (i + 1) / 2 + k; in units of cost
  };
  /// A seam from a point to the next, and squared distance of the lights on its sides.
  struct Seam {
    std::uint32_t to = 0;
    float jump = 0;
  };
  void find_cost(CollapsePlan&) const;
  /// (7a) of p, when it moves to `place` and `other` goes with it.
  double seam_error(std::uint32_t p, std::uint32_t other, const Vec3d& place) const;
  template <class Values>
  static void add_products(Gram&, std::uint32_t v, const Values&, double weight);
  double squared_length_of_unit(const std::vector<std::uint32_t>& ring, std::uint32_t v,
                                const std::vector<Vec2f>& uv) const;
  /// Of the triangles around v, when v at `place` has the attributes (1 - share) v + share w. w may be kNone: then
  /// those of v.
  double vertex_error(std::uint32_t v, std::uint32_t w, double share, const Vec3d& place) const;

  const CollapseMesh& mesh_;
  FieldProducts products_;
  Collapse how_;
  double turned_ = 0;                           // what is kept apart changes by that, squared, as normals turn
  double geometry_ = 0, light_ = 0, even_ = 0;  // factors of Q, of E and of area x squared length
  std::vector<Quadric> quadric_;                // of points
  std::vector<double> area_;                    // around points
  std::vector<std::vector<Seam>> seams_;        // of points
  std::vector<Gram> gram_;                      // of vertices
};

}  // namespace kiln
