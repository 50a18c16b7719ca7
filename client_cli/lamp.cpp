#include "client_cli/lamp.h"

#include <charconv>
#include <cmath>
#include <numbers>

#include "core/mesh/topology.h"
#include "core/trace/surface.h"

namespace kiln {

Outcome<Lamp> parse_lamp(const std::string& text) {
  std::vector<double> numbers;
  const char *at = text.data(), *end = at + text.size();
  bool good = true;
  while (good) {
    double x = 0;
    const auto [next, error] = std::from_chars(at, end, x);
    good = error == std::errc{} && std::isfinite(x);
    numbers.push_back(x);
    at = next;
    if (!good || at == end) break;
    good = *at++ == ',';
  }
  good = good && (numbers.size() == 3 || numbers.size() == 6);
  Lamp lamp;
  if (good) lamp.place = {numbers[0], numbers[1], numbers[2]};
  if (good && numbers.size() == 6) lamp.intensity = {numbers[3], numbers[4], numbers[5]};
  if (!good || lamp.intensity.x < 0 || lamp.intensity.y < 0 || lamp.intensity.z < 0)
    return fail(ExitCode::usage, "light_invalid", "must be x,y,z or x,y,z,r,g,b, intensities not negative", text);
  return lamp;
}

void light_only(Scene& scene, const Lamp& lamp) {
  for (Material& m : scene.materials) m.emission = {};
  Light light{.position = to_float(scene.frame.to_unit(lamp.place))};
  light.intensity = to_float(lamp.intensity / (scene.frame.scale * scene.frame.scale));
  scene.lights = {light};
}

std::vector<LightValue> lamp_values(BakedScene baked, const LightLinks& links, const Places& places,
                                    const LampLookup& lookup, Threads& threads) {
  light_only(baked.scene, lookup.lamp);
  const Light& light = baked.scene.lights.front();
  const Tracer tracer(baked.scene, threads);
  baked.transfer = {.order = 0, .channels = 3, .fixed = true, .coefficients = {}};
  baked.glossy = {};
  for (const Vec3f& x : reflected_light(links, light, tracer, baked.scene.mesh.normal, threads))
    baked.transfer.coefficients.insert(baked.transfer.coefficients.end(), {x.x, x.y, x.z});
  std::vector<LightValue> out = artefact_values(baked, places, {}, lookup.look);
  for (std::size_t i = 0; i < out.size() && !lookup.indirect; ++i) {
    if (!places[i]) continue;
    const Mesh& mesh = baked.scene.mesh;
    const Vec3f position = to_float(match_position(mesh, *places[i])),
                normal = to_float(match_normal(mesh, *places[i]));
    Vec3f face = normalized(area_vector(mesh, mesh.triangles[places[i]->triangle]), normal);
    if (dot(face, normal) < 0) face = -face;
    const Vec3d value = to_double(direct_of(light, tracer, offset_origin(position, face), position, normal));
    Vec3d albedo{1, 1, 1};
    if (lookup.look.scene_albedo) {
      albedo = to_double(
          albedo_at(baked.scene, surface_point(baked.scene, places[i]->triangle, static_cast<float>(places[i]->u),
                                               static_cast<float>(places[i]->v))));
    }
    out[i].irradiance += value * std::numbers::pi;
    out[i].radiance += albedo * value;
  }
  return out;
}

}  // namespace kiln
