// A model by paths as the viewer shows a bake of it, from the same eye: references for looking at interiors.
//   kiln_view_paths MODEL OUT.png --pose x,y,z,tx,ty,tz [--env LIGHT] [--light LAMP] [--indirect] [--exposure E]
//                   [--white] [--size WxH] [--samples N]
// --pose is that of the viewer's address, --light that of `kiln reference`, --exposure the viewer's own (of the file
// and its stops); --white shows what a white surface would radiate (the viewer's mode `light`).

#include <cmath>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

#include "client_cli/lamp.h"
#include "client_cli/light_lookup.h"
#include "client_cli/models.h"
#include "client_cli/recipe_input.h"
#include "core/artifact/look.h"
#include "core/artifact/png.h"
#include "core/bake/preview.h"

namespace kiln {
namespace {

struct Asked {
  std::string model, picture, lamp;
  LightOptions light;
  std::vector<float> pose;
  bool indirect = false, white = false;
  float exposure = 1;
  int width = 600, height = 400, samples = 64;
};

struct Ray {
  Vec3f from, way;
};

/// One ray a pixel, by the camera of web_viewer/src/main/stage.ts.
std::vector<Ray> rays_of(const Mesh& mesh, const Asked& asked) {
  Vec3f low = mesh.position.at(0), high = low;
  for (const Vec3f& p : mesh.position)
    for (std::size_t k = 0; k < 3; ++k) low[k] = std::min(low[k], p[k]), high[k] = std::max(high[k], p[k]);
  const Vec3f center = (low + high) * 0.5F;
  const float radius = length(high - low) / 2;
  const Vec3f from = center + Vec3f{asked.pose[0], asked.pose[1], asked.pose[2]} * radius,
              to = center + Vec3f{asked.pose[3], asked.pose[4], asked.pose[5]} * radius;
  const Vec3f back = normalized(from - to), right = normalized(cross(Vec3f{0, 1, 0}, back)), up = cross(back, right);
  const float aspect = static_cast<float>(asked.width) / static_cast<float>(asked.height);
  const float half = std::max(0.32F, 0.48F / aspect);
  std::vector<Ray> out;
  for (int y = 0; y < asked.height; ++y) {
    for (int x = 0; x < asked.width; ++x) {
      const float across = 2 * (static_cast<float>(x) + 0.5F) / static_cast<float>(asked.width) - 1,
                  along = 1 - 2 * (static_cast<float>(y) + 0.5F) / static_cast<float>(asked.height);
      out.push_back({from, normalized(right * (across * half * aspect) + up * (along * half) - back)});
    }
  }
  return out;
}

float srgb(float x) { return x <= 0.0031308F ? 12.92F * x : 1.055F * std::pow(x, 1 / 2.4F) - 0.055F; }

Outcome<void> draw(const Asked& asked) {
  Threads threads;
  KILN_TRY(scene, load_scene(asked.model));
  decode_pixels(scene);
  KILN_TRY(sky, load_light(asked.light));
  if (!asked.lamp.empty()) {
    KILN_TRY(lamp, parse_lamp(asked.lamp));
    light_only(scene, lamp);
  }
  const std::vector<Ray> rays = rays_of(scene.mesh, asked);
  const Tracer tracer(scene, threads);
  Places places;
  std::vector<std::size_t> pixel;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Hit hit = first_facing(tracer, rays[i].from, rays[i].way);
    if (!hit) continue;
    places.emplace_back(SurfaceMatch{hit.triangle, double{hit.u}, double{hit.v}, 0});
    pixel.push_back(i);
  }
  const TraceOptions options{
      .samples = asked.samples, .from = asked.indirect ? 1 : 0, .look = {.scene_albedo = !asked.white}};
  const std::vector<LightValue> values = traced_values(scene, places, sky, options, threads);
  std::vector<std::uint8_t> out(3 * rays.size(), 90);
  for (std::size_t k = 0; k < pixel.size(); ++k) {
    const Vec3f shown = tone_map(to_float(values[k].radiance) * asked.exposure);
    for (std::size_t c = 0; c < 3; ++c)
      out[3 * pixel[k] + c] = static_cast<std::uint8_t>(std::lround(255 * std::clamp(srgb(shown[c]), 0.0F, 1.0F)));
  }
  const Bytes png = write_png({asked.width, asked.height, 3}, out);
  std::ofstream file(asked.picture, std::ios::binary);
  file.write(reinterpret_cast<const char*>(png.data()), static_cast<std::streamsize>(png.size()));
  if (!file.good()) return fail(ExitCode::error, "not_written", "cannot be written", asked.picture);
  return {};
}

std::vector<float> numbers_of(const std::string& text) {
  std::vector<float> out;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find_first_of(",x", at), text.size());
    out.push_back(std::stof(text.substr(at, end - at)));
    at = end + 1;
  }
  return out;
}

std::optional<Asked> parse(const std::vector<std::string>& words) {
  Asked out;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const auto is = [&](const char* name) { return words[i] == name && i + 1 < words.size(); };
    if (is("--env")) {
      out.light.name = words[++i];
    } else if (is("--light")) {
      out.lamp = words[++i];
    } else if (is("--pose")) {
      out.pose = numbers_of(words[++i]);
    } else if (is("--exposure")) {
      out.exposure = std::stof(words[++i]);
    } else if (is("--samples")) {
      out.samples = std::max(2, std::stoi(words[++i]));
    } else if (is("--size")) {
      const std::vector<float> size = numbers_of(words[++i]);
      out.width = static_cast<int>(size.at(0)), out.height = static_cast<int>(size.at(1));
    } else if (words[i] == "--indirect") {
      out.indirect = true;
    } else if (words[i] == "--white") {
      out.white = true;
    } else {
      (out.model.empty() ? out.model : out.picture) = words[i];
    }
  }
  return out.picture.empty() || out.pose.size() != 6 ? std::nullopt : std::optional(out);
}

int run(const std::vector<std::string>& words) {
  const auto asked = parse(words);
  if (!asked) {
    std::fprintf(stderr, "kiln_view_paths MODEL OUT.png --pose x,y,z,tx,ty,tz [--env LIGHT] [--light LAMP] ...\n");
    return 2;
  }
  const auto done = draw(*asked);
  if (!done) std::fprintf(stderr, "%s\n", done.error().problem.detail.c_str());
  return done ? 0 : 1;
}

}  // namespace
}  // namespace kiln

int main(int count, char** words) { return kiln::run({words + 1, words + count}); }
