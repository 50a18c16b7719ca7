#include "tests/bench/light_field_compare.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include "core/base/random.h"
#include "core/lightfield/hemisphere_norm.h"
#include "core/mesh/closest_point.h"
#include "core/mesh/topology.h"
#include "core/sphere/sampling.h"

namespace kiln::bench {
namespace {

constexpr std::size_t kPoints = 40'000;

struct Sampled {
  std::uint32_t triangle;
  Vec3d weights;
};

/// Uniform by area.
std::vector<Sampled> sample_surface(const Mesh& mesh, std::uint64_t seed) {
  std::vector<double> sum;
  double total = 0;
  for (const Triangle& t : mesh.triangles) sum.push_back(total += triangle_area(mesh, t));
  std::vector<Sampled> out;
  for (std::size_t i = 0; i < kPoints; ++i) {
    Random random(seed, i);
    const auto at = std::upper_bound(sum.begin(), sum.end(), random.uniform_double() * total) - sum.begin();
    const Vec2d uv = uniform_triangle({random.uniform_double(), random.uniform_double()});
    out.push_back(
        {static_cast<std::uint32_t>(std::min<std::ptrdiff_t>(at, std::ssize(sum) - 1)), {1 - uv.x - uv.y, uv.x, uv.y}});
  }
  return out;
}

Vec3d mix(const std::vector<Vec3f>& values, const Triangle& t, const Vec3d& w) {
  return to_double(values[t[0]]) * w.x + to_double(values[t[1]]) * w.y + to_double(values[t[2]]) * w.z;
}

std::vector<double> mix(const LightField& field, const Triangle& t, const Vec3d& w) {
  std::vector<double> out(3 * field.count());
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t i = 0; i < out.size(); ++i) out[i] += w[c] * field.of(t[c])[i];
  return out;
}

/// A field of a lower degree is one of this degree with zeros.
std::vector<double> widened(const std::vector<double>& c, std::size_t count) {
  const std::size_t own = c.size() / 3;
  std::vector<double> out(3 * count);
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t i = 0; i < own; ++i) out[k * count + i] = c[k * own + i];
  return out;
}

/// Mean squared distance of points of `from` from `to`; `visit(place on from, nearest on to)`.
template <class Visit>
double mean_squared_distance(const Mesh& from, const Mesh& to, const Visit& visit) {
  const ClosestPoint closest(to);
  double sum = 0;
  for (const Sampled& s : sample_surface(from, 1)) {
    const Triangle& t = from.triangles[s.triangle];
    const Vec3d p = mix(from.position, t, s.weights), n = mix(from.normal, t, s.weights);
    auto match = closest.query(p, n);
    if (!match) match = closest.query(p, {});
    sum += match->distance * match->distance;
    visit(s, *match);
  }
  return sum / static_cast<double>(kPoints);
}

Vec2f mix(const std::vector<Vec2f>& values, const Triangle& t, const Vec3d& w) {
  const Vec3f f = to_float(w);
  return values[t[0]] * f.x + values[t[1]] * f.y + values[t[2]] * f.z;
}

/// How far the texture has slid there, as a length on the surface of the truth.
double texture_shift(const Mesh& truth, const Sampled& s, const Mesh& found, const SurfaceMatch& m) {
  const Triangle& t = truth.triangles[s.triangle];
  const Vec2f off =
      mix(found.uv0, found.triangles[m.triangle], {1 - m.u - m.v, m.u, m.v}) - mix(truth.uv0, t, s.weights);
  const Vec2f a = truth.uv0[t[1]] - truth.uv0[t[0]], b = truth.uv0[t[2]] - truth.uv0[t[0]];
  const double texels = std::abs(double{a.x} * double{b.y} - double{a.y} * double{b.x}) / 2;
  return texels > 0 ? std::sqrt(double{dot(off, off)} * triangle_area(truth, t) / texels) : 0;
}

double rms(const std::vector<double>& values) {
  double squares = 0;
  for (const double x : values) squares += x * x;
  return values.empty() ? 0 : std::sqrt(squares / static_cast<double>(values.size()));
}

}  // namespace

LightFieldError compare(const LitMesh& truth, const LitMesh& found) {
  const HemisphereNorm norm(truth.field.degree);
  std::vector<double> shifts;
  double difference = 0, size = 0;
  const double there = mean_squared_distance(truth.mesh, found.mesh, [&](const Sampled& s, const SurfaceMatch& m) {
    const Triangle& t = truth.mesh.triangles[s.triangle];
    const Vec3d n = normalized(mix(truth.mesh.normal, t, s.weights));
    std::vector<double> a = mix(truth.field, t, s.weights);
    const std::vector<double> b =
        widened(mix(found.field, found.mesh.triangles[m.triangle], {1 - m.u - m.v, m.u, m.v}), truth.field.count());
    size += squared_norm(norm, n, a);
    for (std::size_t i = 0; i < a.size(); ++i) a[i] -= b[i];
    difference += squared_norm(norm, n, a);
    if (!truth.mesh.uv0.empty()) shifts.push_back(texture_shift(truth.mesh, s, found.mesh, m));
  });
  const double back = mean_squared_distance(found.mesh, truth.mesh, [](const Sampled&, const SurfaceMatch&) {});
  Vec3f low = truth.mesh.position[0], high = low;
  for (const Vec3f& p : truth.mesh.position)
    for (std::size_t a = 0; a < 3; ++a) low[a] = std::min(low[a], p[a]), high[a] = std::max(high[a], p[a]);
  const double diagonal = length(to_double(high) - to_double(low));
  for (double& shift : shifts) shift = std::min(shift, 0.01 * diagonal);  // other charts, far away in the atlas
  return {.light = std::sqrt(difference / size),
          .texture = 100 * rms(shifts) / diagonal,
          .distance = 100 * std::sqrt(0.5 * (there + back)) / diagonal};
}

namespace {

template <class T>
void put(std::ofstream& file, const std::vector<T>& values) {
  file.write(reinterpret_cast<const char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(T)));
}

}  // namespace

std::optional<LitMesh> simplify_meshopt(const LitMesh& lit, std::size_t triangles, float weight) {
  const std::string in = "/tmp/kiln_light_field.in", out = "/tmp/kiln_light_field.out";
  {
    std::ofstream file(in, std::ios::binary);
    std::vector<float> colours;
    for (std::size_t v = 0; v < lit.field.vertices(); ++v) {
      for (std::size_t c = 0; c < 3; ++c) colours.push_back(lit.field.of(v)[c * lit.field.count()] * 0.2820948F);
    }
    put(file, std::vector<std::uint32_t>{static_cast<std::uint32_t>(lit.mesh.position.size()),
                                         static_cast<std::uint32_t>(lit.mesh.triangles.size()),
                                         static_cast<std::uint32_t>(triangles)});
    put(file, std::vector<float>{weight});
    put(file, lit.mesh.position), put(file, colours), put(file, lit.mesh.triangles);
  }
  std::remove(out.c_str());
  const std::string command = std::string("node ") + KILN_BENCH_FOLDER + "/light_field_meshopt.mjs " + in + ' ' + out;
  if (std::system(command.c_str()) != 0) return std::nullopt;
  std::ifstream file(out, std::ios::binary);
  LitMesh found = lit;
  found.mesh.triangles.clear();
  for (Triangle t; file.read(reinterpret_cast<char*>(t.data()), sizeof t);) found.mesh.triangles.push_back(t);
  found.mesh.part.assign(found.mesh.triangles.size(), 0);
  drop_unused_vertices(found);
  return found;
}

}  // namespace kiln::bench
