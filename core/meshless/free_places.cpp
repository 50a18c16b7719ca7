#include "core/meshless/free_places.h"

#include <algorithm>
#include <cmath>

#include "core/base/random.h"
#include "core/mesh/topology.h"
#include "core/meshless/points.h"
#include "core/prt/ray_origin.h"
#include "core/sphere/sampling.h"

namespace kiln {
namespace {

constexpr float kHalf = 0.55F;  // of the grown cube
constexpr float kClear = 0.1F;  // of the median reach

float way_out(const Vec3f& from, const Vec3f& w) {
  float far = kFar;
  for (std::size_t i = 0; i < 3; ++i) {
    if (w[i] != 0) far = std::min(far, std::max(0.0F, (std::copysign(kHalf, w[i]) - from[i]) / w[i]));
  }
  return far;
}

/// Whether a lamp could hang there: a quarter of what it sees is surface, none of it within `clear`, and no inside of a
/// solid.
bool is_free(const Tracer& tracer, const GatherFaces& faces, const Vec3f& place, float clear, Random& random) {
  constexpr int kLooks = 64;
  int met = 0;
  for (int i = 0; i < kLooks; ++i) {
    const double u = random.uniform_double(), v = random.uniform_double();
    const Vec3f w = to_float(uniform_sphere({u, v}));
    const Hit hit = tracer.closest(place, w, kFar);
    if (!hit) continue;
    const HitSide side = faces.side(hit.triangle, w);
    if (hit.t < clear || side == HitSide::dark) return false;
    met += side == HitSide::front ? 1 : 0;
  }
  return met >= kLooks / 4;
}

struct Candidates {
  std::vector<Vec3f> places;
  float clear = 0;  // how far surfaces must be
};

Candidates candidate_places(const Tracer& tracer, std::size_t count, std::uint64_t seed) {
  const Scene& scene = tracer.scene();
  const Mesh& mesh = scene.mesh;
  std::vector<double> cumulative;
  double sum = 0;
  for (const Triangle& t : mesh.triangles) cumulative.push_back(sum += triangle_area(mesh, t));
  Candidates out;
  if (!(sum > 0)) return out;
  const GatherFaces faces(scene);
  std::vector<float> reach;
  const std::uint64_t tries = 256 + 64 * std::uint64_t{count};
  for (std::uint64_t i = 0; i < tries; ++i) {
    Random random(seed, i);
    const auto at = std::upper_bound(cumulative.begin(), cumulative.end(), random.uniform_double() * sum);
    const auto triangle =
        std::min<std::size_t>(static_cast<std::size_t>(at - cumulative.begin()), cumulative.size() - 1);
    const Triangle& t = mesh.triangles[triangle];
    const double a = random.uniform_double(), b = random.uniform_double();
    const auto uv = uniform_triangle({a, b});
    const auto u = static_cast<float>(uv.x), v = static_cast<float>(uv.y);
    const Vec3f place = mesh.position[t[0]] * (1 - u - v) + mesh.position[t[1]] * u + mesh.position[t[2]] * v;
    Vec3f face = normalized(area_vector(mesh, t), mesh.normal[t[0]]);
    const bool two_sided =
        scene.materials[static_cast<std::size_t>(scene.parts[mesh.part[triangle]].material)].double_sided;
    if (random.uniform() < 0.5F && two_sided) face = -face;
    const Vec2f towards{random.uniform(), random.uniform()};
    const float share = 0.1F + 0.8F * random.uniform();
    if (is_enclosed(tracer, faces, {place, face, place, face}, true)) continue;
    const Vec3f w = normalized(basis_around(face).to_world(cosine_hemisphere(towards)), face);
    const Vec3f origin = offset_origin(place, face);
    const Hit hit = tracer.closest(origin, w, kFar);
    if (hit && faces.side(hit.triangle, w) == HitSide::dark) continue;
    const float far = hit ? hit.t : way_out(origin, w);
    reach.push_back(far);
    out.places.push_back(origin + w * (share * far));
  }
  if (reach.empty()) return out;
  const auto middle = reach.begin() + static_cast<std::ptrdiff_t>(reach.size() / 2);
  std::nth_element(reach.begin(), middle, reach.end());
  out.clear = kClear * *middle;
  return out;
}

}  // namespace

std::vector<Vec3f> free_places(const Tracer& tracer, std::size_t count, std::uint64_t seed) {
  const Candidates all = candidate_places(tracer, count, seed);
  const GatherFaces faces(tracer.scene());
  std::vector<Vec3f> out;
  for (std::size_t i = 0; i < all.places.size() && out.size() < count; ++i) {
    Random random(mix64(seed), i);
    if (is_free(tracer, faces, all.places[i], all.clear, random)) out.push_back(all.places[i]);
  }
  return out;
}

bool hangs_free(const Tracer& tracer, const Vec3f& place) {
  const float clear = candidate_places(tracer, 0, 1).clear;
  Random random(1, 0);
  return is_free(tracer, GatherFaces(tracer.scene()), place, clear, random);
}

}  // namespace kiln
