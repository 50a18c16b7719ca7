#include "core/bake/light_field_levels.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/lightfield/hemisphere_norm.h"
#include "core/lightfield/progressive_mesh.h"
#include "core/mesh/closest_point.h"
#include "core/mesh/topology.h"

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

/// On the grid of the file: corners that only rounding holds apart are one.
Mesh on_grid(Mesh mesh) {
  constexpr float kSteps = (1 << 20) - 1;  // Encoding::position_bits
  for (Vec3f& p : mesh.position) {
    for (std::size_t k = 0; k < 3; ++k) p[k] = std::round((p[k] + 0.5F) * kSteps) / kSteps - 0.5F;
  }
  return mesh;
}

/// Root mean square of a field over its mean: simplify() counts in parts of the first, certificates of the second.
double rms_over_mean(const Mesh& mesh, const LightField& field) {
  const HemisphereNorm norm(field.degree);
  const std::size_t count = field.count();
  std::vector<double> area(mesh.position.size());
  for (const Triangle& t : mesh.triangles) {
    for (const std::uint32_t v : t) area[v] += triangle_area(mesh, t);
  }
  double squares = 0, mean = 0, all = 0;
  for (std::size_t v = 0; v < area.size(); ++v) {
    const std::vector<double> rgb = mean_light(field, v);
    squares += area[v] * squared_norm(norm, to_double(mesh.normal[v]), rgb) / 3;
    mean += area[v] * (rgb[0] + rgb[count] + rgb[2 * count]) / (3 * 2 * std::sqrt(std::numbers::pi));
    all += area[v];
  }
  return mean > 0 && all > 0 ? std::sqrt(squares / all) / (mean / all) : 1;
}

/// Simplifies in steps while the judged interval ends below the target. `unit`: of simplify()'s errors. How much a step
/// really adds to what it is estimated to tells how large the next one is.
SimplifyResult coarsest(SimplifyResult baked, const FieldPlan& plan, double unit, const JudgeLevel& judge,
                        std::optional<ErrorStats>& error, Threads& threads) {
  constexpr int kMostSteps = 5;
  constexpr double kRoom = 0.95, kFirst = 0.5, kNear = 0.92;  // of the target; near the bound
  constexpr double kLeast = 1.15, kMost = 3, kShy = 0.87;     // of the last step; of one that failed
  Simplify params = *plan.simplify;
  error = judge(baked.lit.mesh, baked.lit.field);
  // Storage comes after this, and the file is certified at places of its own.
  const double bound = kRoom * std::sqrt(std::max(0.0, std::pow(*plan.target, 2) - std::pow(plan.storage, 2)));
  if (error->interval_high > bound) {
    params.max_error = error->relrmse / 4 / unit;
    return simplify(std::move(baked.lit), params, threads);
  }
  SimplifyResult last = std::move(baked);
  double done = 0, squares = 0, wanted = kFirst * *plan.target / unit, failed = std::numeric_limits<double>::infinity();
  for (int step = 0; step < kMostSteps; ++step) {
    params.max_error = std::sqrt(wanted * wanted - done * done);
    SimplifyResult next = simplify(last.lit, params, threads);
    if (next.lit.mesh.triangles.size() == last.lit.mesh.triangles.size()) {
      const double larger = std::min(kMost * wanted, kShy * failed);
      if (!(larger > wanted)) break;
      wanted = larger;
      continue;
    }
    const ErrorStats now = judge(next.lit.mesh, next.lit.field);
    if (now.interval_high > bound) {
      failed = wanted;
    } else {
      squares += next.error * next.error;
      last = std::move(next);
      last.error = std::sqrt(squares);
      done = wanted;
      if (now.interval_high > kNear * bound) break;
    }
    const double added = std::sqrt(std::max(1e-12, std::pow(now.relrmse, 2) - std::pow(error->relrmse, 2))) / wanted;
    const double aim = kNear * bound * now.relrmse / now.interval_high;
    const double left = std::sqrt(std::max(0.0, aim * aim - std::pow(error->relrmse, 2))) / added;
    const double least = kLeast * done, most = std::min(kMost * std::max(done, wanted), kShy * failed);
    wanted = std::clamp(left, std::min(least, most), most);
    if (!(wanted > done)) break;
  }
  last.reached = true;
  return last;
}

std::size_t coarser(const FieldLevel& level, std::size_t times) {
  return std::max<std::size_t>(4, level.mesh.triangles.size() / times);
}

}  // namespace

FieldLevels make_levels(const Mesh& mesh, const Transfer& transfer, LightField field, const FieldPlan& plan,
                        const JudgeLevel& judge, BakeLog& log, Threads& threads) {
  const NearestLight light(mesh, transfer);
  const double unit = rms_over_mean(mesh, field);
  FieldLevels out;
  SimplifyResult last{.lit = {on_grid(mesh), std::move(field)}, .reached = true};
  double squares = 0;
  const auto add_level = [&] {
    squares += std::pow(last.error * unit, 2);
    const LightField& own = last.lit.field;
    Transfer diffuse = own.has_diffuse() ? Transfer{0, 3, true, own.diffuse} : light.at(last.lit.mesh, threads);
    out.levels.push_back({last.lit.mesh, own, std::move(diffuse), std::sqrt(squares), last.reached});
  };
  if (plan.simplify && plan.target) {
    last = coarsest(std::move(last), plan, unit, judge, out.baked, threads);
  } else if (plan.simplify) {
    Simplify params = *plan.simplify;
    params.max_error /= unit;
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
    out.progressive = progressive_mesh(simplify({first.mesh, first.field}, params, threads).record);
  }
  return out;
}

}  // namespace kiln
