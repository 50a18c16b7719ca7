// Direct-to-indirect links: size, time and error on the shared scenes. One JSON line a run.
//   kiln_transport [scene: cornell | dungeon | hotel | all] [name=value ...]
// Values: points, levels, sender_level, most_senders, rays, eps, split, largest, bounces; those not given are the
// defaults. Error: relRMSE of reflected light at random points of the surface that can be seen, for lamps in random
// free places, against paths; the links are read at the points themselves, so that no mesh comes in. Of each lamp:
// relRMSE, bias, and error over the root mean square of the light instead of its mean.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#include "core/base/random.h"
#include "core/mesh/topology.h"
#include "core/meshless/free_places.h"
#include "core/meshless/link_builder.h"
#include "core/prt/hidden.h"
#include "core/sphere/sampling.h"
#include "core/trace/reference.h"
#include "core/trace/surface.h"
#include "tests/bench/bench.h"
#include "tests/core/prt/reference_set.h"

namespace kiln::bench {
namespace {

constexpr std::size_t kPoints = 1500, kLamps = 6;
constexpr int kPaths = 512;

/// Each point as the first corner of a tiny triangle of its face.
Mesh points_as_mesh(const Tracer& tracer, std::vector<ReferencePoint>& at) {
  const Scene& scene = tracer.scene();
  const HiddenTest hidden = hidden_test(tracer);
  std::vector<double> cumulative;
  double sum = 0;
  for (const Triangle& t : scene.mesh.triangles) cumulative.push_back(sum += triangle_area(scene.mesh, t));
  Mesh out;
  for (std::uint64_t i = 0; at.size() < kPoints && i < 50 * kPoints; ++i) {
    Random random(99, i);
    const auto found = std::upper_bound(cumulative.begin(), cumulative.end(), random.uniform_double() * sum);
    const auto t = static_cast<std::uint32_t>(
        std::min<std::ptrdiff_t>(found - cumulative.begin(), static_cast<std::ptrdiff_t>(cumulative.size()) - 1));
    const double a = random.uniform_double(), b = random.uniform_double();
    const auto uv = uniform_triangle({a, b});
    const Triangle& corners = scene.mesh.triangles[t];
    const auto u = static_cast<float>(uv.x), v = static_cast<float>(uv.y);
    const Vec3f place = scene.mesh.position[corners[0]] * (1 - u - v) + scene.mesh.position[corners[1]] * u +
                        scene.mesh.position[corners[2]] * v;
    const Vec3f shading = normalized(scene.mesh.normal[corners[0]] * (1 - u - v) + scene.mesh.normal[corners[1]] * u +
                                     scene.mesh.normal[corners[2]] * v);
    const Vec3f winding = normalized(area_vector(scene.mesh, corners), shading);
    const Vec3f face = dot(winding, shading) < 0 ? -winding : winding;
    if (hidden({place, shading, place, face})) continue;
    const auto first = static_cast<std::uint32_t>(out.position.size());
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3f& corner = scene.mesh.position[corners[(k)]];
      out.position.push_back(k == 0 ? place : place + (corner - place) * 1e-4F);
      out.normal.push_back(shading);
    }
    out.triangles.push_back({first, first + 1, first + 2});
    out.part.push_back(scene.mesh.part[t]);
    at.push_back({place, shading, face});
  }
  return out;
}

double mean_of(const Vec3d& x) { return (x.x + x.y + x.z) / 3; }

void run(const std::string& name, const Scene& scene, const LinkParams& params, const std::string& knobs,
         Threads& threads) {
  const Tracer tracer(scene, threads);
  std::vector<ReferencePoint> at;
  const Mesh places = points_as_mesh(tracer, at);
  ReferenceLight light;
  for (const Vec3f& place : free_places(tracer, kLamps, 4242))
    light.lamps.push_back({.intensity = {1, 1, 1}, .position = place});
  const ReferenceResult truth = trace_reference(tracer, at, light, {.samples = kPaths, .from = 1}, threads);

  const double start = process_seconds();
  LinkBuilder builder(tracer, params, threads);
  const LightLinks links = builder.finish(places, threads);
  const double seconds = process_seconds() - start;
  std::string errors;
  double all = 0, biases = 0;
  for (std::size_t k = 0; k < light.lamps.size(); ++k) {
    const std::vector<Vec3f> x = reflected_light(links, light.lamps[k], tracer, places.normal, threads);
    double error = 0, noise = 0, mean = 0, bias = 0, squares = 0;
    for (std::size_t i = 0; i < at.size(); ++i) {
      const Vec3d t = truth.value[k * at.size() + i], own = to_double(x[3 * i]);
      const Vec3d apart = truth.half_a[k * at.size() + i] - truth.half_b[k * at.size() + i];
      error += dot(own - t, own - t) / 3, noise += dot(apart, apart) / 12;
      squares += dot(t, t) / 3;
      mean += mean_of(t), bias += mean_of(own - t);
    }
    const double n = static_cast<double>(at.size());
    const double relative = mean > 0 ? std::sqrt(std::max(0.0, error - noise) / n) / (mean / n) : 0;
    char text[64];
    std::snprintf(text, sizeof text, "%s[%.4f,%.4f,%.4f]", k > 0 ? "," : "", relative, mean > 0 ? bias / mean : 0,
                  std::sqrt(std::max(0.0, error - noise) / std::max(squares - noise, 1e-30)));
    errors += text;
    all += relative * relative, biases += mean > 0 ? bias / mean : 0;
  }
  const double start_apply = wall_seconds();
  const std::vector<Vec3f> dark(links.senders);
  (void)gather_links(links, solve_nodes(links, dark), threads);
  const double apply = wall_seconds() - start_apply;
  const double lamps = static_cast<double>(std::max<std::size_t>(1, light.lamps.size()));
  std::printf(
      "{\"bench\":\"transport\",\"scene\":\"%s\",\"knobs\":\"%s\",\"triangles\":%zu,\"cpu_s\":%.2f,\"rays\":%llu,"
      "\"senders\":%u,\"rows\":%zu,\"links\":%zu,\"a_row\":%.1f,\"of_possible\":%.5f,\"bytes\":%zu,\"sweeps\":%u,"
      "\"tail\":%.2f,\"alone\":%zu,\"apply_ms\":%.1f,\"relrmse\":%.4f,\"bias\":%.4f,\"lamps\":[%s]}\n",
      name.c_str(), knobs.c_str(), scene.mesh.triangles.size(), seconds,
      static_cast<unsigned long long>(builder.stats().rays), links.senders, links.rows(), links.links.size(),
      static_cast<double>(links.links.size()) / static_cast<double>(std::max<std::size_t>(1, links.rows())),
      links.share_of_possible(),
      links.links.size() * 8 + links.samples.size() * 16 + links.rows() * 24 + links.children.size() * 4, links.sweeps,
      static_cast<double>(links.tail), builder.stats().alone, 1000 * apply, std::sqrt(all / lamps), biases / lamps,
      errors.c_str());
  std::fflush(stdout);
}

void set_knob(LinkParams& params, const char* text) {
  const char* equals = std::strchr(text, '=');
  if (equals == nullptr) return;
  const std::string name(text, equals);
  const double x = std::atof(equals + 1);
  if (name == "points") params.points.wanted = static_cast<std::uint64_t>(x);
  if (name == "levels") params.points.levels = static_cast<int>(x);
  if (name == "sender_level") params.sender_level = static_cast<int>(x);
  if (name == "most_senders") params.most_senders = static_cast<std::uint32_t>(x);
  if (name == "rays") params.rays = static_cast<int>(x);
  if (name == "eps") params.eps = static_cast<float>(x);
  if (name == "split") params.oracle.split = static_cast<float>(x);
  if (name == "largest") params.oracle.largest = static_cast<float>(x);
  if (name == "bounces") params.bounces = static_cast<int>(x);
}

}  // namespace
}  // namespace kiln::bench

int main(int argc, char** argv) {
  using namespace kiln;
  using namespace kiln::bench;
  const std::string only = argc > 1 ? argv[1] : "all";
  LinkParams params;
  std::string knobs;
  for (int i = 2; i < argc; ++i) set_knob(params, argv[i]), knobs += (i > 2 ? " " : "") + std::string(argv[i]);
  Threads threads(2);
  const struct {
    const char *name, *path;
  } kScenes[] = {{"cornell", "references/cornell.glb"},
                 {"dungeon", "scenes/dungeon-interior/level-dungeon.gltf"},
                 {"hotel", "scenes/hotel-room/scene.glb"}};
  for (const auto& s : kScenes) {
    if (only != "all" && only != s.name) continue;
    if (const auto scene = testing::load_scene(KILN_SHARED, s.path)) run(s.name, *scene, params, knobs, threads);
  }
}
