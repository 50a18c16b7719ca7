#include "core/bake/preview.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/artifact/evaluate.h"
#include "core/artifact/eye.h"
#include "core/artifact/look.h"
#include "core/artifact/png.h"
#include "core/bake/eye_material.h"
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

/// The first face that looks at the camera, passing through those that look away.
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

struct Painter {
  const BakedScene& baked;
  const Tracer& tracer;
  std::vector<Vec3f> value;
  EyeLight light;

  Vec3f background(float height) const {
    const float t = std::clamp(height, 0.0F, 1.0F);
    return Vec3f{0.055F, 0.06F, 0.07F} * (1 - t) + Vec3f{0.16F, 0.17F, 0.19F} * t;
  }

  Vec3f color(const Vec3f& eye, const Vec3f& direction, float height) const {
    const Hit hit = first_facing(tracer, eye, direction);
    if (!hit) return background(height);
    const Scene& scene = tracer.scene();
    const SurfacePoint place = surface_point(scene, hit.triangle, hit.u, hit.v);
    const Triangle& t = scene.mesh.triangles[hit.triangle];
    if (baked.glossy && has_matrices(baked.glossy, t)) return shown(specular(hit, place, t, direction), place);
    const Vec3f at = value[t[0]] * (1 - hit.u - hit.v) + value[t[1]] * hit.u + value[t[2]] * hit.v;
    return shown(at * albedo_at(scene, place), place);
  }

  Vec3f shown(const Vec3f& reflected, const SurfacePoint& place) const {
    return tone_map((reflected + emission_at(tracer.scene(), place)) * baked.exposure);
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

}  // namespace

Result<Bytes> render_preview(const BakedScene& decoded, const Tracer& tracer, const Preview& preview,
                             Threads& threads) {
  const Camera camera = frame_camera(decoded.scene.mesh, preview);
  const Painter painter{decoded, tracer, values_of(decoded.transfer, decoded.light.coefficients),
                        eye_light(decoded, decoded.light.coefficients, true)};
  const auto width = static_cast<std::size_t>(preview.width), height = static_cast<std::size_t>(preview.height);
  Bytes pixels(width * height * 3);
  threads.for_blocks(height, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y) {
      for (std::size_t x = 0; x < width; ++x) {
        Vec3f sum;
        for (int s = 0; s < preview.grid * preview.grid; ++s) {
          const int column = s % preview.grid, row = s / preview.grid;
          const float dx = (static_cast<float>(column) + 0.5F) / static_cast<float>(preview.grid);
          const float dy = (static_cast<float>(row) + 0.5F) / static_cast<float>(preview.grid);
          const float px = (static_cast<float>(x) + dx) / static_cast<float>(width) * 2 - 1;
          const float py = 1 - (static_cast<float>(y) + dy) / static_cast<float>(height) * 2;
          const Vec3f direction = normalized(camera.forward + camera.right * px + camera.up * py);
          sum += painter.color(camera.eye, direction, (py + 1) / 2);
        }
        sum *= 1.0F / static_cast<float>(preview.grid * preview.grid);
        for (std::size_t c = 0; c < 3; ++c) pixels[(y * width + x) * 3 + c] = srgb_byte(sum[c]);
      }
    }
  });
  return write_png({preview.width, preview.height, 3}, pixels);
}

}  // namespace kiln
