// print_seen SCENE.glb: what eyes see of the light field in a scene.glb, as CSV; fixtures/field.csv is made with it.
// One row for each of some triangles of each part: part, triangle (counted in the part), barycentrics of corners 1
// and 2, unit normal, unit view, radiance.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <numbers>
#include <vector>

#include "core/artifact/baked_scene.h"
#include "core/base/random.h"
#include "core/lightfield/seen.h"

namespace {

using namespace kiln;

constexpr std::size_t kRows = 40;  // of a part

Vec3d normal_at(const Mesh& mesh, const Triangle& t, double u, double v) {
  return normalized(to_double(mesh.normal[t[0]]) * (1 - u - v) + to_double(mesh.normal[t[1]]) * u +
                    to_double(mesh.normal[t[2]]) * v);
}

Vec3d any_direction(Random& random) {
  const double z = 2 * random.uniform_double() - 1, angle = 2 * std::numbers::pi * random.uniform_double();
  const double r = std::sqrt(std::max(0.0, 1 - z * z));
  return {r * std::cos(angle), r * std::sin(angle), z};
}

void print_part(const BakedScene& baked, std::size_t part) {
  const Mesh& mesh = baked.scene.mesh;
  const auto own = std::ranges::equal_range(mesh.part, part);  // parts follow one another
  const auto before = static_cast<std::size_t>(own.begin() - mesh.part.begin());
  for (std::size_t row = 0; row < kRows; ++row) {
    Random random(1, part, row);
    const std::size_t t = row * own.size() / kRows;
    const Triangle& triangle = mesh.triangles[before + t];
    double u = random.uniform_double(), v = random.uniform_double();
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const Vec3d n = normal_at(mesh, triangle, u, v), w = any_direction(random);
    const Vec3d seen = seen_radiance(baked.field, triangle, u, v, n, w);
    std::printf("%zu,%zu,%.17g,%.17g", part, t, u, v);
    for (const Vec3d& x : {n, w, seen}) std::printf(",%.17g,%.17g,%.17g", x.x, x.y, x.z);
    std::printf("\n");
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::ifstream file(argc > 1 ? argv[1] : "", std::ios::binary);
  const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(file), {}};
  const auto baked = read_baked_glb(bytes);
  if (!baked || baked->field.vertices() == 0) {
    std::fprintf(stderr, "%s\n", baked ? "there is no light field in it" : baked.error().message.c_str());
    return 1;
  }
  std::puts("part,triangle,u,v,nx,ny,nz,vx,vy,vz,r,g,b");
  for (std::size_t part = 0; part < baked->scene.parts.size(); ++part) print_part(*baked, part);
}
