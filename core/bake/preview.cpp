#include "core/bake/preview.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/artifact/evaluate.h"
#include "core/artifact/eye.h"
#include "core/artifact/look.h"
#include "core/artifact/png.h"
#include "core/bake/eye_material.h"
#include "core/bake/field_eye.h"
#include "core/scene/texture.h"
#include "core/trace/reference.h"
#include "core/trace/surface.h"

namespace kiln {
namespace {

struct Camera {
  Vec3f eye, forward, right, up;  // right and up scaled to half the picture's extent at distance 1
};

struct Box {
  Vec3f low{1, 1, 1}, high{-1, -1, -1};
};

Box bounds_of(const Mesh& mesh) {
  Box box;
  for (const Vec3f& p : mesh.position) {
    for (std::size_t k = 0; k < 3; ++k) {
      box.low[k] = std::min(box.low[k], p[k]);
      box.high[k] = std::max(box.high[k], p[k]);
    }
  }
  return box;
}

/// Looks at the middle of the bounding box from a little above, just far enough to hold its eight corners.
Camera frame_camera(const Mesh& mesh, const Preview& preview) {
  constexpr float kHalfView = 0.32F;  // tangent of half the vertical angle
  constexpr float kMargin = 1.06F;
  const float aspect = static_cast<float>(preview.width) / static_cast<float>(preview.height);
  const Box box = bounds_of(mesh);
  const Vec3f middle = (box.low + box.high) * 0.5F, back = normalized(Vec3f{0.45F, 0.42F, 0.9F});
  const Vec3f right = normalized(cross(-back, {0, 1, 0})), up = normalized(cross(right, -back));
  float distance = 1e-3F;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3f p = Vec3f{corner & 1 ? box.high.x : box.low.x, corner & 2 ? box.high.y : box.low.y,
                          corner & 4 ? box.high.z : box.low.z} -
                    middle;
    const float across = std::abs(dot(p, right)) / (kHalfView * aspect), along = std::abs(dot(p, up)) / kHalfView;
    distance = std::max(distance, dot(p, back) + kMargin * std::max(across, along));
  }
  return {middle + back * distance, -back, right * (kHalfView * aspect), up * kHalfView};
}

/// `height` of the picture: 0 below, 1 above.
Vec3f background(float height) {
  const float t = std::clamp(height, 0.0F, 1.0F);
  return Vec3f{0.055F, 0.06F, 0.07F} * (1 - t) + Vec3f{0.16F, 0.17F, 0.19F} * t;
}

struct Painter {
  const BakedScene& baked;
  const Tracer& tracer;
  std::vector<Vec3f> value;
  EyeLight light;
  FieldEye field;

  Vec3f color(const Vec3f& eye, const Vec3f& direction, float height) const {
    const Hit hit = first_facing(tracer, eye, direction);
    if (!hit) return background(height);
    const Scene& scene = tracer.scene();
    const SurfacePoint place = surface_point(scene, hit.triangle, hit.u, hit.v);
    const Triangle& t = scene.mesh.triangles[hit.triangle];
    if (!baked.field.coefficients.empty()) return tone_map(of_field(hit, place, direction) * baked.exposure);
    if (baked.glossy && has_matrices(baked.glossy, t)) return shown(specular(hit, place, t, direction), place);
    return shown(light_at(hit, t) * albedo_at(scene, place), place);
  }

  /// What a white surface would send out.
  Vec3f light_at(const Hit& hit, const Triangle& t) const {
    const Mesh& mesh = tracer.scene().mesh;
    const auto mix = [&](const auto& x) { return x[t[0]] * (1 - hit.u - hit.v) + x[t[1]] * hit.u + x[t[2]] * hit.v; };
    const Lightmap& map = baked.lightmap;
    return map.side > 0 && map.parts[mesh.part[hit.triangle]] != 0 ? map.at(mix(mesh.uv1)) : mix(value);
  }

  Vec3f shown(const Vec3f& reflected, const SurfacePoint& place) const {
    return tone_map((reflected + emission_at(tracer.scene(), place)) * baked.exposure);
  }

  Vec3f of_field(const Hit& hit, const SurfacePoint& place, const Vec3f& direction) const {
    const Vec3d normal = normalized(to_double(place.normal)), view = normalized(to_double(-direction));
    const SurfaceMatch match{hit.triangle, double{hit.u}, double{hit.v}, 0};
    return to_float(field.seen(match, normal, view));
  }

  /// All that a part with matrices reflects to the camera.
  Vec3f specular(const Hit& hit, const SurfacePoint& place, const Triangle& t, const Vec3f& direction) const {
    const Vec3d normal = normalized(to_double(place.normal)), view = normalized(to_double(-direction));
    const EyeMaterial material = eye_material(tracer.scene(), place);
    const EyeRadiance seen = eye_radiance(baked, light, {{t, hit.u, hit.v}, normal, view, material});
    return to_float(seen.diffuse + seen.specular);
  }
};

std::uint8_t srgb_byte(float x) {
  const float s = x <= 0.0031308F ? 12.92F * x : 1.055F * std::pow(x, 1 / 2.4F) - 0.055F;
  return static_cast<std::uint8_t>(std::lround(std::clamp(s, 0.0F, 1.0F) * 255));
}

/// The rays of a picture, row by row, those of a pixel together.
struct Rays {
  Camera camera;
  Preview preview;

  std::size_t of_pixel() const {
    return static_cast<std::size_t>(preview.grid) * static_cast<std::size_t>(preview.grid);
  }
  std::size_t of_row() const { return static_cast<std::size_t>(preview.width) * of_pixel(); }
  std::size_t rows() const { return static_cast<std::size_t>(preview.height); }
  std::size_t all() const { return of_row() * rows(); }

  struct Ray {
    Vec3f direction;
    float height;  // see background()
  };
  Ray at(std::size_t i) const {
    const std::size_t pixel = i % of_row() / of_pixel(), part = i % of_pixel();
    const auto grid = static_cast<std::size_t>(preview.grid);
    const auto place = [&](std::size_t whole, std::size_t sub, int size) {
      const float within = (static_cast<float>(sub) + 0.5F) / static_cast<float>(preview.grid);
      return (static_cast<float>(whole) + within) / static_cast<float>(size) * 2 - 1;
    };
    const float px = place(pixel, part % grid, preview.width), py = -place(i / of_row(), part / grid, preview.height);
    return {normalized(camera.forward + camera.right * px + camera.up * py), (py + 1) / 2};
  }
};

/// PNG of what `color(i, ray)` says of each ray, linear.
template <class Color>
Bytes paint(const Rays& rays, const Color& color, Threads& threads) {
  const Preview& preview = rays.preview;
  const std::size_t width = static_cast<std::size_t>(preview.width), n = rays.of_pixel();
  Bytes pixels(width * rays.rows() * 3);
  threads.for_blocks(rays.rows(), 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t pixel = begin * width; pixel < end * width; ++pixel) {
      Vec3f sum;
      for (std::size_t i = pixel * n; i < (pixel + 1) * n; ++i) sum += color(i, rays.at(i));
      sum *= 1.0F / static_cast<float>(n);
      for (std::size_t c = 0; c < 3; ++c) pixels[pixel * 3 + c] = srgb_byte(sum[c]);
    }
  });
  return write_png({preview.width, preview.height, 3}, pixels);
}

/// The normal that a viewer shows: interpolated, and bent by the normal map in the interpolated tangent frame.
Vec3f shown_normal(const Scene& scene, const SurfacePoint& place) {
  const Mesh& mesh = scene.mesh;
  const Part& part = scene.parts[mesh.part[place.triangle]];
  const TextureRef& map = scene.materials[static_cast<std::size_t>(part.material)].normal_texture;
  if (map.texture < 0 || map.uv_set != 0 || !part.has_tangent || !part.has_uv0) return place.normal;
  Vec3f tangent, bitangent;
  Vec2f uv;
  const float weights[3] = {1 - place.u - place.v, place.u, place.v};
  for (std::size_t c = 0; c < 3; ++c) {
    const auto v = mesh.triangles[place.triangle][c];
    const Vec4f& t = mesh.tangent[v];
    tangent += Vec3f{t.x, t.y, t.z} * weights[c];
    bitangent += cross(mesh.normal[v], Vec3f{t.x, t.y, t.z}) * (t.w * weights[c]);
    uv = {uv.x + mesh.uv0[v].x * weights[c], uv.y + mesh.uv0[v].y * weights[c]};
  }
  const Vec4f texel = sample_texture(scene, map, uv, false);
  const Vec3f bent = normalized(tangent) * ((2 * texel.x - 1) * map.scale) +
                     normalized(bitangent) * ((2 * texel.y - 1) * map.scale) + place.normal * (2 * texel.z - 1);
  if (!(dot(bent, bent) > 0) || !std::isfinite(dot(bent, bent))) return place.normal;
  const Vec3f normal = normalized(bent);
  return dot(normal, place.geometric_normal) > 0 ? normal : place.normal;
}

/// What a stretch of rays sees, by the path tracer: linear radiance, and -1 where nothing is.
void look(const Tracer& tracer, const Rays& rays, const ReferenceLight& light, const PlainPreview& how,
          std::size_t begin, std::span<Vec3f> seen, Threads& threads) {
  const Scene& scene = tracer.scene();
  std::vector<SurfacePoint> places(seen.size());
  std::vector<std::uint8_t> found(seen.size());
  threads.for_blocks(seen.size(), 1024, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      const Hit hit = first_facing(tracer, rays.camera.eye, rays.at(begin + i).direction);
      found[i] = hit ? 1 : 0;
      if (hit) places[i] = surface_point(scene, hit.triangle, hit.u, hit.v);
    }
  });
  std::vector<ReferencePoint> points;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (found[i] != 0)
      points.push_back({places[i].position, shown_normal(scene, places[i]), places[i].geometric_normal});
  }
  const ReferenceOptions options{.samples = how.samples, .bounces = how.bounces, .seed = begin};
  const std::vector<Vec3d> value = trace_reference(tracer, points, light, options, threads).value;
  std::size_t k = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    seen[i] = {-1, -1, -1};
    if (found[i] == 0) continue;
    const Vec3f arriving = to_float(value[k] + value[points.size() + k]);  // the sky's, and the scene's own lights'
    seen[i] = arriving * albedo_at(scene, places[i]) + emission_at(scene, places[i]);
    ++k;
  }
}

/// As automatic_exposure, over what is seen.
float exposure_of(std::span<const Vec3f> seen) {
  std::vector<float> bright;
  for (const Vec3f& c : seen) {
    if (const float b = std::max({c.x, c.y, c.z}); b > 0) bright.push_back(b);
  }
  if (bright.empty()) return 1;
  const auto at = bright.begin() + static_cast<std::ptrdiff_t>(static_cast<double>(bright.size() - 1) * 0.9);
  std::nth_element(bright.begin(), at, bright.end());
  return exposure_for(*at);
}

}  // namespace

Hit first_facing(const Tracer& tracer, Vec3f origin, const Vec3f& direction) {
  for (int layer = 0; layer < 16; ++layer) {
    const Hit hit = tracer.closest(origin, direction, std::numeric_limits<float>::infinity());
    if (!hit || !hit.back) return hit;
    const SurfacePoint place = surface_point(tracer.scene(), hit.triangle, hit.u, hit.v);
    origin = offset_origin(place.position, place.geometric_normal);
    if (dot(place.geometric_normal, direction) < 0) origin = offset_origin(place.position, -place.geometric_normal);
  }
  return {};
}

Result<Bytes> render_preview(const BakedScene& decoded, const Tracer& tracer, const Preview& preview,
                             Threads& threads) {
  const Rays rays{frame_camera(decoded.scene.mesh, preview), preview};
  const Painter painter{decoded, tracer, shown_values(decoded.transfer, decoded.light.parts()),
                        eye_light(decoded, decoded.light.parts()),
                        FieldEye(tracer.scene(), decoded.field, decoded.sky)};
  const auto color = [&](std::size_t, const Rays::Ray& ray) {
    return painter.color(rays.camera.eye, ray.direction, ray.height);
  };
  return paint(rays, color, threads);
}

Bytes render_plain_preview(const Tracer& tracer, const Environment& sky, const PlainPreview& how, Threads& threads) {
  constexpr std::size_t kRows = 16;  // whose points are held at a time
  const Rays rays{frame_camera(tracer.scene().mesh, how.picture), how.picture};
  const ReferenceLight light{.environments = {sky}, .sh = {}, .scene_lights = true};
  std::vector<Vec3f> seen(rays.all());
  for (std::size_t row = 0; row < rays.rows(); row += kRows) {
    const std::size_t begin = row * rays.of_row(), rows = std::min(kRows, rays.rows() - row);
    look(tracer, rays, light, how, begin, std::span(seen).subspan(begin, rows * rays.of_row()), threads);
    threads.check();
    if (how.advance) how.advance(row + rows, rays.rows());
  }
  const float exposure = exposure_of(seen);
  const auto color = [&](std::size_t i, const Rays::Ray& ray) {
    return seen[i].x < 0 ? background(ray.height) : tone_map(seen[i] * exposure);
  };
  return paint(rays, color, threads);
}

}  // namespace kiln
