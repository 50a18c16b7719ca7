#include "tests/core/artifact/random_baked.h"

#include <cmath>

#include "core/base/random.h"

namespace kiln {
namespace {

constexpr int kParts = 4;

/// A height that depends on the place alone, so that neighbouring parts meet exactly.
float height(float x, float z) { return 0.1F * std::sin(7 * x) * std::cos(5 * z); }

void add_grid(Scene& scene, int part, int side, Random& random) {
  Mesh& mesh = scene.mesh;
  const auto first = static_cast<std::uint32_t>(mesh.position.size());
  const auto row = static_cast<std::uint32_t>(side) + 1;
  const auto centered = [&] { return 2 * random.uniform() - 1; };
  for (int i = 0; i <= side; ++i) {
    for (int j = 0; j <= side; ++j) {
      const float x = -0.5F + 0.25F * (static_cast<float>(part) + static_cast<float>(j) / static_cast<float>(side));
      const float z = -0.5F + static_cast<float>(i) / static_cast<float>(side);
      mesh.position.push_back({x, height(x, z), z});
      mesh.normal.push_back(normalized(Vec3f{centered(), centered(), centered()}));
      mesh.uv0.push_back({40 * centered() + 100, centered()});
      mesh.uv1.push_back({random.uniform(), random.uniform()});
      mesh.color.push_back({random.uniform(), random.uniform(), random.uniform(), random.uniform()});
      const Vec3f t = normalized(Vec3f{centered(), centered(), centered()});
      mesh.tangent.push_back({t.x, t.y, t.z, centered() < 0 ? -1.0F : 1.0F});
    }
  }
  for (std::uint32_t i = 0; i + 1 < row; ++i) {
    for (std::uint32_t j = 0; j + 1 < row; ++j) {
      const std::uint32_t a = first + i * row + j;
      mesh.triangles.insert(mesh.triangles.end(), {{a, a + row, a + 1}, {a + 1, a + row, a + row + 1}});
      mesh.part.insert(mesh.part.end(), 2, static_cast<std::uint32_t>(part));
    }
  }
}

void add_materials(Scene& scene) {
  scene.materials.resize(2);
  scene.materials[0].name = "plain";
  scene.materials[0].base_color = {0.25F, 0.5F, 0.75F, 1};
  scene.materials[1].name = "glow";
  scene.materials[1].base_color = {0.1F, 0.2F, 0.3F, 0.9F};
  scene.materials[1].emission = {0, 12.5F, 3};
}

void add_coefficients(Transfer& t, std::size_t vertices, double magnitude, Random& random) {
  t.coefficients.resize(vertices * t.stride());
  for (std::size_t v = 0; v < vertices; ++v) {
    float* out = &t.coefficients[v * t.stride()];
    out[0] = static_cast<float>(v);
    for (std::size_t s = 1; s < t.stride(); ++s) {
      out[s] = static_cast<float>(magnitude * (2 * random.uniform_double() - 1));
    }
  }
}

}  // namespace

BakedScene random_baked(const RandomBaked& params) {
  BakedScene out;
  Random random(params.seed, 0);
  for (int part = 0; part < kParts; ++part) add_grid(out.scene, part, params.side, random);
  add_materials(out.scene);
  out.scene.parts = {{"plain", 0, false, false, false, false},
                     {"textured", 1, true, false, false, false},
                     {"coloured", 0, true, false, true, false},
                     {"everything", 1, true, true, true, true}};
  out.scene.frame = {{3, -2, 1e3}, 12.5};
  out.transfer = {params.order, params.channels, params.fixed, {}};
  add_coefficients(out.transfer, out.scene.mesh.position.size(), params.magnitude, random);
  out.provenance = R"({"engine":"test","seed":1})";
  return out;
}

std::vector<std::uint32_t> original_vertices(const BakedScene& read) {
  std::vector<std::uint32_t> out(read.transfer.vertices());
  for (std::size_t v = 0; v < out.size(); ++v) {
    out[v] = static_cast<std::uint32_t>(std::lround(std::max(0.0F, read.transfer.at(v, 0)[0])));
  }
  return out;
}

}  // namespace kiln
