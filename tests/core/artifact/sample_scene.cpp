#include "tests/core/artifact/sample_scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/artifact/look.h"
#include "core/artifact/png.h"
#include "core/sphere/sh.h"
#include "tests/core/artifact/random_baked.h"

namespace kiln {
namespace {

constexpr float kRadius = 0.2F, kFloor = -0.3F;
constexpr int kGrid = 48, kRings = 32;

void add_vertex(Mesh& mesh, const Vec3f& position, const Vec3f& normal, const Vec2f& uv) {
  mesh.position.push_back(position);
  mesh.normal.push_back(normal);
  mesh.uv0.push_back(uv);
  mesh.color.push_back({0.5F + 0.5F * normal.x, 0.5F + 0.5F * normal.y, 0.5F + 0.5F * normal.z, 1});
}

void add_quad(Mesh& mesh, std::uint32_t corner, std::uint32_t row, std::uint32_t part) {
  const std::uint32_t a = corner, b = corner + 1, c = corner + row, d = corner + row + 1;
  mesh.triangles.insert(mesh.triangles.end(), {{a, c, b}, {b, c, d}});
  mesh.part.insert(mesh.part.end(), {part, part});
}

void add_plane(Mesh& mesh) {
  const auto first = static_cast<std::uint32_t>(mesh.position.size());
  for (int i = 0; i <= kGrid; ++i) {
    for (int j = 0; j <= kGrid; ++j) {
      const float u = static_cast<float>(j) / kGrid, v = static_cast<float>(i) / kGrid;
      add_vertex(mesh, {u - 0.5F, kFloor, v - 0.5F}, {0, 1, 0}, {4 * u, 4 * v});
    }
  }
  for (std::uint32_t i = 0; i < kGrid; ++i) {
    for (std::uint32_t j = 0; j < kGrid; ++j) add_quad(mesh, first + i * (kGrid + 1) + j, kGrid + 1, 0);
  }
}

void add_sphere(Mesh& mesh) {
  const auto first = static_cast<std::uint32_t>(mesh.position.size());
  for (int i = 0; i <= kRings; ++i) {
    for (int j = 0; j <= 2 * kRings; ++j) {
      const float theta = std::numbers::pi_v<float> * static_cast<float>(i) / kRings;
      const float phi = std::numbers::pi_v<float> * static_cast<float>(j % (2 * kRings)) / kRings;
      const Vec3f n =
          normalized(Vec3f{std::sin(theta) * std::cos(phi), std::cos(theta), -std::sin(theta) * std::sin(phi)});
      add_vertex(mesh, n * kRadius, n, {0, 0});
    }
  }
  for (std::uint32_t i = 0; i < kRings; ++i) {
    for (std::uint32_t j = 0; j < 2 * kRings; ++j) add_quad(mesh, first + i * (2 * kRings + 1) + j, 2 * kRings + 1, 1);
  }
}

/// How open the sky is from here: the plane looks darker under the sphere, the sphere darker below.
float openness(const Vec3f& p, const Vec3f& n) {
  if (p.y == kFloor) {
    const float d2 = p.x * p.x + p.z * p.z + kFloor * kFloor;
    return 1 - kRadius * kRadius / d2 * (-kFloor / std::sqrt(d2));
  }
  return 0.6F + 0.4F * n.y;
}

void add_transfer(const Mesh& mesh, Transfer& t) {
  const auto n = static_cast<std::size_t>(sh_count(t.order)), slots = static_cast<std::size_t>(t.slots());
  t.coefficients.assign(mesh.position.size() * t.stride(), 0);
  std::vector<float> cosine(n);
  for (std::size_t v = 0; v < mesh.position.size(); ++v) {
    clamped_cosine_transfer(t.order, mesh.normal[v], cosine.data());
    const float open = openness(mesh.position[v], mesh.normal[v]);
    for (std::size_t c = 0; c < static_cast<std::size_t>(t.channels); ++c) {
      float* out = &t.coefficients[v * t.stride() + c * slots];
      for (std::size_t i = 0; i < n; ++i) out[i] = cosine[i] * open * (1 - 0.05F * static_cast<float>(c));
      if (t.fixed) out[n] = std::max(0.0F, mesh.normal[v].x) * (c == 2 ? 0.1F : 0.4F);  // a warm lamp far along +x
    }
  }
}

Image checker() {
  Bytes pixels;
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      const std::uint8_t shade = (x / 32 + y / 32) % 2 == 0 ? 235 : 170;
      pixels.insert(pixels.end(), {shade, shade, shade});
    }
  }
  return {"checker", "image/png", write_png({64, 64, 3}, pixels), 64, 64, {}};
}

/// A blue sky that is brighter towards +x: bands 0 and 1 of white light plus a tint.
std::vector<Vec3f> soft_sky(int order) {
  std::vector<Vec3f> light(static_cast<std::size_t>(sh_count(order)));
  light[0] = Vec3f{0.9F, 1.0F, 1.2F} * (2 * std::sqrt(std::numbers::pi_v<float>));
  if (order > 1) {
    light[1] = {0.8F, 0.9F, 1.3F};
    light[3] = {1.2F, 1.0F, 0.7F};
  }
  return light;
}

}  // namespace

BakedScene sphere_over_plane(int order, int channels, bool fixed) {
  BakedScene out;
  Scene& scene = out.scene;
  add_plane(scene.mesh);
  add_sphere(scene.mesh);
  scene.frame = {{0, 1, 0}, 4};
  scene.images = {checker()};
  scene.textures = {{0, Wrap::repeat, Wrap::repeat, false}};
  scene.materials.resize(2);
  scene.materials[0].name = "floor";
  scene.materials[0].base_color_texture.texture = 0;
  scene.materials[1].name = "ball";
  scene.materials[1].base_color = {0.9F, 0.6F, 0.5F, 1};
  scene.parts = {{"floor", 0, true, false, false, false}, {"ball", 1, false, false, true, false}};
  out.transfer = {order, channels, fixed, {}};
  add_transfer(scene.mesh, out.transfer);
  out.light = {"soft sky", soft_sky(order)};
  out.exposure = automatic_exposure(scene.mesh, baked_colors(out));
  out.provenance = R"({"engine":"sample","seed":0})";
  return out;
}

BakedScene open_sky(Scene scene, int order) {
  BakedScene out;
  out.scene = std::move(scene);
  out.transfer = {order, 1, false, {}};
  out.transfer.coefficients.resize(out.scene.mesh.position.size() * out.transfer.stride());
  for (std::size_t v = 0; v < out.scene.mesh.position.size(); ++v) {
    clamped_cosine_transfer(order, out.scene.mesh.normal[v], &out.transfer.coefficients[v * out.transfer.stride()]);
  }
  out.light = {"soft sky", soft_sky(order)};
  out.exposure = automatic_exposure(out.scene.mesh, baked_colors(out));
  return out;
}

BakedScene everything(int order, int channels) {
  BakedScene out = random_baked({.order = order, .channels = channels, .fixed = true});
  Scene& scene = out.scene;
  scene.images = {checker(), {"lost", "image/jpeg", {}, 0, 0, {}}};
  scene.textures = {{0, Wrap::mirror, Wrap::clamp, true}, {1, Wrap::repeat, Wrap::repeat, false}};
  scene.materials[0].base_color_texture.texture = 0;  // part 0 has no texture coordinates for it
  Material& m = scene.materials[1];
  m.base_color_texture = {0, 0, {0, 2, 0.5F, -3, 0, 0.25F}, 1};  // a quarter turn, scaled by 3 and 2
  m.metallic_roughness_texture.texture = m.emission_texture.texture = 1;
  m.normal_texture = {0, 0, {1, 0, 0, 0, 1, 0}, 0.5F};
  m.alpha_mode = AlphaMode::mask;
  m.double_sided = true;
  scene.lights = {{LightType::directional, "sun", {3, 2, 1}, {}, {0, -1, 0}, 0, 0, 0},
                  {LightType::point, "bulb", {0, 0.5F, 0}, {0.1F, 0.2F, -0.3F}, {0, 0, -1}, 0.25F, 0, 0},
                  {LightType::spot, "spot", {9, 9, 9}, {0.5F, 0, 0}, {0, 0, 1}, 0, 0.1F, 0.9F}};
  out.light = {"soft sky", soft_sky(order)};
  out.exposure = automatic_exposure(scene.mesh, baked_colors(out));
  return out;
}

BakedScene single_triangle(int order, int channels, bool fixed) {
  BakedScene out;
  Mesh& mesh = out.scene.mesh;
  mesh.position = {{-0.5F, 0, -0.5F}, {-0.5F, 0, 0.5F}, {0.5F, 0, 0.5F}};
  mesh.normal = {{0, 1, 0}, {0, 1, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  mesh.part = {0};
  out.scene.materials.resize(1);
  out.scene.parts = {{"triangle", 0, false, false, false, false}};
  out.transfer = {order, channels, fixed, {}};
  out.transfer.coefficients.assign(3 * out.transfer.stride(), 0);
  out.provenance = "{}";
  return out;
}

TransferEncoding as_components(const BakedScene& baked, std::size_t rank) {
  const std::vector<double> sun(static_cast<std::size_t>(baked.transfer.order), 4 * M_PI);
  const ComponentAnalysis analysis = analyse_components(baked.transfer, baked.scene.mesh, sun);
  return {.components = analysis.first(rank), .weights = analysis.weights(baked.transfer, rank)};
}

}  // namespace kiln
