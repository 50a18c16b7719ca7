#include "core/bake/light_field_levels.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/lightfield/progressive_mesh.h"
#include "core/mesh/closest_point.h"

namespace kiln {
namespace {

/// Light of order 0 at the vertices of another mesh of the same shape.
class NearestLight {
 public:
  NearestLight(const Mesh& mesh, const Transfer& transfer) : mesh_(mesh), transfer_(transfer), nearest_(mesh) {}

  Transfer at(const Mesh& other, Threads& threads) const {
    Transfer out{0, 3, true, std::vector<float>(3 * other.position.size())};
    threads.for_blocks(other.position.size(), 256, [&](std::size_t begin, std::size_t end) {
      for (std::size_t v = begin; v < end; ++v) {
        const auto match = nearest_.query(to_double(other.position[v]), to_double(other.normal[v]));
        if (!match) continue;
        const Triangle& t = mesh_.triangles[match->triangle];
        for (int c = 0; c < 3; ++c) {
          const double light = (1 - match->u - match->v) * double{*transfer_.at(t[0], c)} +
                               match->u * double{*transfer_.at(t[1], c)} + match->v * double{*transfer_.at(t[2], c)};
          out.coefficients[3 * v + static_cast<std::size_t>(c)] = static_cast<float>(light);
        }
      }
    });
    return out;
  }

 private:
  const Mesh& mesh_;
  const Transfer& transfer_;
  ClosestPoint nearest_;
};

std::size_t coarser(const FieldLevel& level, std::size_t times) {
  return std::max<std::size_t>(4, level.mesh.triangles.size() / times);
}

}  // namespace

FieldLevels make_levels(const Mesh& mesh, const Transfer& transfer, LightField field, const FieldPlan& plan,
                        BakeLog& log, Threads& threads) {
  const NearestLight light(mesh, transfer);
  FieldLevels out;
  SimplifyResult last{.lit = {mesh, std::move(field)}, .reached = true};
  double squares = 0;
  const auto add_level = [&] {
    squares += last.error * last.error;
    out.levels.push_back(
        {last.lit.mesh, last.lit.field, light.at(last.lit.mesh, threads), std::sqrt(squares), last.reached});
  };
  if (plan.simplify) {
    Simplify params = *plan.simplify;
    if (plan.ratio)
      params.triangles = static_cast<std::size_t>(*plan.ratio * static_cast<double>(mesh.triangles.size()));
    last = simplify(std::move(last.lit), params, threads);
    if (params.triangles == 0) last.reached = true;  // it went as far as the error allows
  }
  add_level();
  Simplify params = plan.simplify.value_or(Simplify{});
  params.max_error = std::numeric_limits<double>::infinity();
  const std::uint64_t all = static_cast<std::uint64_t>(plan.lods) + 1;
  for (std::uint64_t k = 1; k < all; ++k) {
    log.advance(k, all);
    params.triangles = coarser(out.levels.back(), 4);
    last = simplify(std::move(last.lit), params, threads);
    add_level();
  }
  if (plan.progressive) {
    const FieldLevel& first = out.levels.front();
    params.triangles = plan.lods > 0 ? out.levels.back().mesh.triangles.size() : coarser(first, 64);
    params.record = true;
    out.progressive = encode_progressive(progressive_mesh(simplify({first.mesh, first.field}, params, threads).record));
  }
  return out;
}

}  // namespace kiln
