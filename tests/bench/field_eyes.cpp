// Light fields as eyes see them, beside path-traced truth.
//   kiln_field_eyes MODEL OUT.png FILE... [--env LIGHT] [--eyes N] [--pixels N] [--samples N]
// OUT.png has a row for each of N eyes around MODEL: what each FILE (of bakes of MODEL) shows, then MODEL by paths, two
// a side of rays a pixel and so many paths a ray. One JSON line for each FILE: root mean square of the difference to
// the paths over what both cover, in parts of the display's range, and CIELAB distance of pixels.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

#include "client_cli/light_lookup.h"
#include "client_cli/models.h"
#include "client_cli/recipe_input.h"
#include "core/artifact/look.h"
#include "core/artifact/png.h"
#include "core/bake/field_eye.h"
#include "core/bake/level_switch.h"
#include "core/bake/preview.h"
#include "core/trace/surface.h"

namespace kiln {
namespace {

constexpr int kGrid = 2;  // rays a side of a pixel
constexpr std::size_t kRays = kGrid * kGrid;
constexpr float kGrey = 0.2F;  // linear, where nothing is

struct Asked {
  std::string model, picture;
  std::vector<std::string> files;
  LightOptions light;
  int eyes = 2, samples = 64;
  std::size_t pixels = 256;  // a side
};

struct Ray {
  Vec3f from, way;
};

/// All of the picture of one eye around the mesh, those of a pixel together.
std::vector<Ray> rays_of(const Mesh& mesh, int eye, const Asked& asked) {
  Vec3f low = mesh.position.at(0), high = low;
  for (const Vec3f& p : mesh.position)
    for (std::size_t k = 0; k < 3; ++k) low[k] = std::min(low[k], p[k]), high[k] = std::max(high[k], p[k]);
  const float phi = 6.2831853F * (static_cast<float>(eye) + 0.1F) / static_cast<float>(asked.eyes);
  const Vec3f back = normalized(Vec3f{std::sin(phi), 0.3F, std::cos(phi)});
  const Vec3f right = normalized(cross(Vec3f{0, 1, 0}, back)), up = cross(back, right);
  const float radius = length(high - low) / 2, half = 0.24F;  // tangent of half the view
  const Vec3f at = (low + high) * 0.5F + back * (0.9F * radius / half);
  const std::size_t across = asked.pixels * kGrid;
  std::vector<Ray> out;
  for (std::size_t pixel = 0; pixel < asked.pixels * asked.pixels; ++pixel) {
    for (std::size_t part = 0; part < kRays; ++part) {
      const std::size_t x = pixel % asked.pixels * kGrid + part % kGrid,
                        y = pixel / asked.pixels * kGrid + part / kGrid;
      const auto place = [&](std::size_t i) {
        return half * (2 * (static_cast<float>(i) + 0.5F) / static_cast<float>(across) - 1);
      };
      out.push_back({at, normalized(right * place(x) - up * place(y) - back)});
    }
  }
  return out;
}

/// Radiance along rays, and whether anything is there.
struct Seen {
  std::vector<Vec3d> radiance;
  std::vector<std::uint8_t> there;
};

Seen see_field(const BakedScene& baked, const std::vector<Ray>& rays, Threads& threads) {
  const Tracer tracer(baked.scene, threads);
  const FieldEye field(tracer.scene(), baked.field, baked.sky);
  Seen out{std::vector<Vec3d>(rays.size()), std::vector<std::uint8_t>(rays.size())};
  threads.for_blocks(rays.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Hit hit = first_facing(tracer, rays[i].from, rays[i].way);
      if (!hit) continue;
      const SurfacePoint place = surface_point(tracer.scene(), hit.triangle, hit.u, hit.v);
      out.there[i] = 1;
      out.radiance[i] = field.seen({hit.triangle, double{hit.u}, double{hit.v}, 0}, normalized(to_double(place.normal)),
                                   to_double(-rays[i].way));
    }
  });
  return out;
}

Seen see_paths(const Scene& scene, const std::vector<Ray>& rays, const std::optional<Environment>& sky, int samples,
               Threads& threads) {
  const Tracer tracer(scene, threads);
  Places places;
  std::vector<QueryPoint> points;
  Seen out{std::vector<Vec3d>(rays.size()), std::vector<std::uint8_t>(rays.size())};
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Hit hit = first_facing(tracer, rays[i].from, rays[i].way);
    if (!hit) continue;
    out.there[i] = 1;
    places.emplace_back(SurfaceMatch{hit.triangle, double{hit.u}, double{hit.v}, 0});
    points.push_back({.position = {}, .normal = {}, .view = to_double(-rays[i].way)});
  }
  const TraceOptions options{.samples = samples, .highlights = true, .look = {true, points}};
  const std::vector<LightValue> values = traced_values(scene, places, sky, options, threads);
  for (std::size_t i = 0, k = 0; i < rays.size(); ++i)
    if (out.there[i] != 0) out.radiance[i] = values[k++].radiance;
  return out;
}

/// Linear, tone mapped; w is 1 where all rays of the pixel have met something.
std::vector<Vec4f> pixels_of(const Seen& seen, float exposure) {
  std::vector<Vec4f> out(seen.there.size() / kRays);
  for (std::size_t i = 0; i < seen.there.size(); ++i) {
    const Vec3f c = seen.there[i] != 0 ? tone_map(to_float(seen.radiance[i]) * exposure) : Vec3f{kGrey, kGrey, kGrey};
    Vec4f& p = out[i / kRays];
    if (i % kRays == 0) p.w = 1;
    p.x += c.x / kRays, p.y += c.y / kRays, p.z += c.z / kRays;
    if (seen.there[i] == 0) p.w = 0;
  }
  return out;
}

float srgb(float x) { return x <= 0.0031308F ? 12.92F * x : 1.055F * std::pow(x, 1 / 2.4F) - 0.055F; }

class Sheet {
 public:
  Sheet(std::size_t columns, std::size_t rows, std::size_t side)
      : side_(side), width_(columns * side), pixels_(3 * columns * rows * side * side) {}
  void put(std::size_t column, std::size_t row, const std::vector<Vec4f>& panel) {
    for (std::size_t i = 0; i < panel.size(); ++i) {
      const std::size_t at = 3 * ((row * side_ + i / side_) * width_ + column * side_ + i % side_);
      const std::array<float, 3> c{panel[i].x, panel[i].y, panel[i].z};
      for (std::size_t k = 0; k < 3; ++k)
        pixels_[at + k] = static_cast<std::uint8_t>(std::lround(255 * std::clamp(srgb(c[k]), 0.0F, 1.0F)));
    }
  }
  bool write(const std::string& path) const {
    const auto height = static_cast<int>(pixels_.size() / (3 * width_));
    const Bytes png = write_png({static_cast<int>(width_), height, 3}, pixels_);
    std::ofstream file(path, std::ios::binary);
    file.write(reinterpret_cast<const char*>(png.data()), static_cast<std::streamsize>(png.size()));
    return file.good();
  }

 private:
  std::size_t side_, width_;
  std::vector<std::uint8_t> pixels_;
};

/// Of pixels that both cover, over all eyes.
struct Difference {
  double squares = 0, lab = 0, pixels = 0;
  void add(const std::vector<Vec4f>& a, const std::vector<Vec4f>& b) {
    for (std::size_t i = 0; i < a.size(); ++i) {
      if (!(a[i].w > 0 && b[i].w > 0)) continue;
      const Vec3d x{a[i].x, a[i].y, a[i].z}, y{b[i].x, b[i].y, b[i].z};
      const Vec3d off = x - y, seen = cielab(x) - cielab(y);
      squares += dot(off, off) / 3, lab += dot(seen, seen), pixels += 1;
    }
  }
};

Outcome<void> draw(const Asked& asked) {
  Threads threads;
  KILN_TRY(scene, load_scene(asked.model));
  decode_pixels(scene);
  KILN_TRY(sky, load_light(asked.light));
  std::vector<BakedScene> files;
  for (const std::string& path : asked.files) {
    KILN_TRY(baked, load_artefact(path));
    decode_pixels(baked.scene);
    files.push_back(std::move(baked));
  }
  const auto eyes = static_cast<std::size_t>(asked.eyes);
  Sheet sheet(files.size() + 1, eyes, asked.pixels);
  std::vector<Difference> off(files.size());
  for (std::size_t eye = 0; eye < eyes; ++eye) {
    const std::vector<Ray> rays = rays_of(scene.mesh, static_cast<int>(eye), asked);
    const float exposure = files.at(0).exposure;
    const auto truth = pixels_of(see_paths(scene, rays, sky, asked.samples, threads), exposure);
    sheet.put(files.size(), eye, truth);
    for (std::size_t k = 0; k < files.size(); ++k) {
      const auto shown = pixels_of(see_field(files[k], rays, threads), exposure);
      sheet.put(k, eye, shown);
      off[k].add(shown, truth);
    }
  }
  for (std::size_t k = 0; k < files.size(); ++k) {
    const double count = std::max(1.0, off[k].pixels);
    std::printf(R"({"file":"%s","triangles":%zu,"display_rms":%.4f,"cielab_rms":%.2f})"
                "\n",
                asked.files[k].c_str(), files[k].scene.mesh.triangles.size(), std::sqrt(off[k].squares / count),
                std::sqrt(off[k].lab / count));
  }
  if (!sheet.write(asked.picture)) return fail(ExitCode::error, "not_written", "cannot be written", asked.picture);
  return {};
}

std::optional<Asked> parse(const std::vector<std::string>& words) {
  Asked out;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const auto is = [&](const char* name) { return words[i] == name && i + 1 < words.size(); };
    if (is("--env")) {
      out.light.name = words[++i];
    } else if (is("--eyes")) {
      out.eyes = std::max(1, std::stoi(words[++i]));
    } else if (is("--pixels")) {
      out.pixels = std::stoul(words[++i]);
    } else if (is("--samples")) {
      out.samples = std::max(2, std::stoi(words[++i]));
    } else if (out.model.empty() || out.picture.empty()) {
      (out.model.empty() ? out.model : out.picture) = words[i];
    } else {
      out.files.push_back(words[i]);
    }
  }
  return out.files.empty() ? std::nullopt : std::optional(out);
}

int run(const std::vector<std::string>& words) {
  const auto asked = parse(words);
  if (!asked) {
    std::fprintf(stderr, "kiln_field_eyes MODEL OUT.png FILE... [--env LIGHT] [--eyes N] [--pixels N] [--samples N]\n");
    return 2;
  }
  const auto done = draw(*asked);
  if (!done) std::fprintf(stderr, "%s\n", done.error().problem.detail.c_str());
  return done ? 0 : 1;
}

}  // namespace
}  // namespace kiln

int main(int count, char** words) { return kiln::run({words + 1, words + count}); }
