// Surface light fields: what the algebra, the metric and simplification cost, and how far off results are.
//   kiln_light_field all MODELS                        the tables of core/lightfield/README.md; MODELS: shared/models
//   kiln_light_field carried FILE [RATIO]              one simplification of a scene.glb that has its light
//   kiln_light_field scale VERTICES [DEGREE] [RATIO]   time and memory of one simplification
//   kiln_light_field figures MODELS FOLDER             its pictures: figure7.jpg, figure8.jpg, figure9.jpg
#include <sys/resource.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>
#include <string>

#include "core/artifact/carried_scene.h"
#include "core/base/random.h"
#include "core/lightfield/hemisphere_norm.h"
#include "core/lightfield/mean_radiance.h"
#include "core/lightfield/simplify.h"
#include "core/sphere/quadrature.h"
#include "core/sphere/sampling.h"
#include "tests/bench/bench.h"
#include "tests/bench/light_field_compare.h"
#include "tests/bench/light_field_figures.h"
#include "tests/bench/light_field_models.h"

namespace kiln::bench {
namespace {

constexpr std::size_t kRing = 6;  // neighbours of a vertex, on average

/// Nanoseconds of one call of `body`, the least of several rounds.
template <class Body>
double nanoseconds(int calls, const Body& body) {
  double least = HUGE_VAL;
  for (int round = 0; round < 7; ++round) {
    const double start = thread_seconds();
    for (int i = 0; i < calls; ++i) body(i);
    least = std::min(least, thread_seconds() - start);
  }
  return 1e9 * least / calls;
}

/// The best that quadrature can do: functions upright already, harmonics at the nodes at hand.
class TabulatedQuadrature {
 public:
  explicit TabulatedQuadrature(int degree) : count_(static_cast<std::size_t>(sh_count(degree + 1))) {
    const int steps = 2 * degree + 1;
    for (const QuadratureNode& node : gauss_legendre(degree + 1)) {
      const double z = 0.5 * (node.x + 1), radius = std::sqrt(1 - z * z);
      for (int k = 0; k < steps; ++k) {
        const double phi = 2 * std::numbers::pi * k / steps;
        values_.resize(values_.size() + count_);
        evaluate_sh(degree + 1, Vec3d{radius * std::cos(phi), radius * std::sin(phi), z},
                    values_.data() + values_.size() - count_);
        weights_.push_back(0.5 * node.weight / steps);
      }
    }
  }
  double squared_norm(const double* rgb) const {  // coefficient i of channel c is rgb[4 i + c]
    double sum = 0;
    const double* y = values_.data();
    for (const double weight : weights_) {
      double value[4] = {};
      for (std::size_t i = 0; i < count_; ++i)
        for (std::size_t c = 0; c < 4; ++c) value[c] += y[i] * rgb[4 * i + c];
      sum += weight * (value[0] * value[0] + value[1] * value[1] + value[2] * value[2]);
      y += count_;
    }
    return sum;
  }

 private:
  std::size_t count_;
  std::vector<double> values_, weights_;
};

void measure_distance(int degree) {
  const HemisphereNorm norm(degree);
  const TabulatedQuadrature tabulated(degree);
  const std::size_t count = norm.count();
  Random random(1, 0);
  std::vector<double> rgb(4 * count), ring(count * 3 * kRing), work;
  for (double& x : rgb) x = random.uniform_double() - 0.5;
  for (double& x : ring) x = random.uniform_double() - 0.5;
  std::array<Vec3d, 64> normals;
  for (Vec3d& n : normals) n = uniform_sphere({random.uniform_double(), random.uniform_double()});
  volatile double sink = 0;
  const auto normal = [&](int i) { return normals[static_cast<std::size_t>(i) % 64]; };
  const double quadrature = nanoseconds(100, [&](int i) {
    sink = squared_norm_by_quadrature(degree, normal(i), {rgb.data(), 3 * count});
  });
  const double table = nanoseconds(1000, [&](int) { sink = tabulated.squared_norm(rgb.data()); });
  const double single = nanoseconds(1000, [&](int i) {
    sink = squared_norm(norm, normal(i), {rgb.data(), 3 * count});
  });
  // All that a removed vertex needs for its half-edge candidates: the ring upright, and the products of all pairs.
  const double per_vertex = nanoseconds(1000, [&](int i) {
    work = ring;
    norm.to_coordinates(normal(i), 3 * kRing, work.data());
    double gram[kRing][kRing] = {};
    for (std::size_t k = 0; k < count; ++k) {
      const double* row = work.data() + k * 3 * kRing;
      for (std::size_t a = 0; a < kRing; ++a)
        for (std::size_t b = 0; b <= a; ++b)
          for (std::size_t c = 0; c < 3; ++c) gram[a][b] += row[3 * a + c] * row[3 * b + c];
    }
    sink = gram[kRing - 1][0];
  });
  const double all_in = per_vertex / (kRing * (kRing - 2));  // each candidate leaves ring - 2 triangles
  std::printf(R"({"bench":"distance","degree":%d,"quadrature_ns":%.0f,"tabulated_quadrature_ns":%.0f,"closed_ns":%.0f,)"
              R"("vertex_ns":%.0f,"all_in_ns":%.0f,"ratio":%.1f,"ratio_to_tabulated":%.1f})"
              "\n",
              degree, quadrature, table, single, per_vertex, all_in, quadrature / all_in, table / all_in);
}

double peak_megabytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

Paint veins(const Vec3f& p) {
  const float wood = noise(p, 0.11F), grain = noise(p, 0.03F);
  return {.albedo = {0.3F + 0.5F * wood, 0.2F + 0.4F * wood * grain, 0.1F + 0.3F * grain},
          .gloss = 0.1F + 0.5F * noise(p, 0.2F)};
}

/// What one candidate collapse costs, and the Gram matrix that a vertex keeps for its candidates.
void measure_candidate(int degree) {
  Mesh mesh = relief_torus(100);
  LitMesh lit{.mesh = mesh, .field = paint_light(mesh, degree, 0.02, veins)};
  const SurfacePoints points = find_surface_points(lit);
  CollapseMesh connected(lit, points);
  CollapseCost cost(connected, 0.01, Collapse::edge);
  const auto vertices = static_cast<std::uint32_t>(lit.mesh.position.size());
  for (std::uint32_t p = 0; p < connected.points(); ++p) cost.update_point(p);
  const double gram = nanoseconds(1,
                                  [&](int) {
                                    for (std::uint32_t v = 0; v < vertices; ++v) cost.update_vertex(v);
                                  }) /
                      vertices;
  volatile double sink = 0;
  const auto& triangles = lit.mesh.triangles;
  const double plan = nanoseconds(1,
                                  [&](int) {
                                    for (const Triangle& t : triangles)
                                      sink = cost.plan(connected.point(t[0]), connected.point(t[1])).cost;
                                  }) /
                      static_cast<double>(triangles.size());
  std::printf(R"({"bench":"candidate","degree":%d,"candidate_ns":%.0f,"vertex_ns":%.0f})"
              "\n",
              degree, plan, gram);
}

/// Time and memory of one simplification to a share of the triangles.
void measure_scale(std::uint32_t vertices, int degree, double ratio) {
  Mesh mesh = relief_torus(static_cast<std::uint32_t>(std::lround(std::sqrt(vertices / 2.0))));
  LitMesh lit{.mesh = mesh, .field = paint_light(mesh, degree, 0.02, veins)};
  const auto count = static_cast<double>(mesh.position.size());
  const auto target = static_cast<std::size_t>(ratio * static_cast<double>(mesh.triangles.size()));
  mesh = {};
  Threads threads;
  const double before = process_seconds(), wall = wall_seconds();
  const SimplifyResult out = simplify(std::move(lit), {.triangles = target}, threads);
  const double seconds = process_seconds() - before;
  std::printf(R"({"bench":"scale","vertices":%.0f,"degree":%d,"triangles":%zu,"cpu_seconds":%.2f,"seconds":%.2f,)"
              R"("us_a_vertex":%.1f,"peak_mb":%.0f,"error":%.4f})"
              "\n",
              count, degree, out.lit.mesh.triangles.size(), seconds, wall_seconds() - wall, 1e6 * seconds / count,
              peak_megabytes(), out.error);
}

double bytes_of(const LitMesh& lit) {
  return static_cast<double>(lit.mesh.position.size() * (24 + 12 * lit.field.count()) + 12 * lit.mesh.triangles.size());
}

/// `estimate`: SimplifyResult::error, of ours.
void tell(const char* bench, const std::string& by, const LitMesh& truth, const LitMesh& found, double seconds,
          double estimate = 0) {
  const LightFieldError e = compare(truth, found);
  std::printf(R"({"bench":"%s","by":"%s","triangles":%zu,"degree":%d,"bytes":%.0f,"seconds":%.2f,)"
              R"("light_error":%.4f,"distance_percent":%.4f,"texture_percent":%.4f,"estimate":%.4f})"
              "\n",
              bench, by.c_str(), found.mesh.triangles.size(), found.field.degree, bytes_of(found), seconds, e.light,
              e.distance, e.texture, estimate);
  std::fflush(stdout);
}

void tell_ours(const char* bench, const std::string& by, const LitMesh& truth, const Simplify& params) {
  Threads threads;
  const double start = process_seconds();
  const SimplifyResult out = simplify(truth, params, threads);
  tell(bench, by, truth, out.lit, process_seconds() - start, out.error);
}

/// Plain vertex colours: ours against meshoptimizer's attribute-aware simplifier.
void measure_colours(const std::string& model, const std::vector<std::size_t>& targets) {
  Threads threads;
  LitMesh lit{.mesh = load_model(model), .field = {}};
  lit.field = bake_colours(lit.mesh, threads);
  for (const std::size_t target : targets) {
    for (const auto& [name, how] : {std::pair("edge", Collapse::edge), std::pair("half-edge", Collapse::half_edge)}) {
      for (const double weight : {0.01, 0.1}) {
        const std::string by = std::string("ours, ") + name + ", geometry " + std::to_string(weight).substr(0, 4);
        tell_ours("colours", by, lit, {.triangles = target, .geometry_weight = weight, .collapse = how});
      }
    }
    for (const float weight : {0.0F, 0.1F, 0.3F, 1.0F, 3.0F}) {
      const double start = process_seconds();
      const auto found = simplify_meshopt(lit, target, weight);
      if (!found) return;
      const std::string by = "meshoptimizer, weight " + std::to_string(weight).substr(0, 4);
      tell("colours", by, lit, *found, process_seconds() - start);
    }
  }
}

/// Ours and extended quadrics on mean colours at the same number of triangles, each at weights that trade light for
/// shape.
void measure_against_colours(const char* bench, const LitMesh& lit, double ratio, Collapse how) {
  const auto target = static_cast<std::size_t>(ratio * static_cast<double>(lit.mesh.triangles.size()));
  const std::string name = how == Collapse::edge ? "edge" : "half-edge";
  for (const double weight : {0.0001, 0.001, 0.003, 0.01, 0.03}) {
    const std::string by = "ours, " + name + ", geometry " + std::to_string(weight).substr(0, 6);
    tell_ours(bench, by, lit, {.triangles = target, .geometry_weight = weight, .collapse = how});
  }
  for (const double weight : {0.01, 0.03, 0.1, 0.3, 1.0}) {
    const double start = process_seconds();
    const LitMesh rival = simplify_colour_qem(lit, target, how, weight);
    const std::string by = "colour quadrics, " + name + ", weight " + std::to_string(weight).substr(0, 4);
    tell(bench, by, lit, rival, process_seconds() - start);
  }
}

LitMesh bronze_statue(const std::string& model, int degree) {
  Threads threads;
  LitMesh lit{.mesh = load_model(model), .field = {}};
  const Coat bronze{.roughness = 0.3, .f0 = {0.7F, 0.5F, 0.3F}, .albedo = {0.02F, 0.02F, 0.02F}};
  const Coat patina{.roughness = 0.45, .f0 = {0.3F, 0.4F, 0.35F}, .albedo = {0.05F, 0.15F, 0.12F}};
  const auto here = [](const Vec3f& p) { return noise(p, 0.1F); };
  lit.field = shine(lit.mesh, degree, bronze, patina, here, threads);
  return lit;
}

/// As many triangles of `whole` as take the bytes of `reduced`.
std::size_t equal_memory(const LitMesh& whole, const LitMesh& reduced) {
  return static_cast<std::size_t>(bytes_of(reduced) / bytes_of(whole) *
                                  static_cast<double>(whole.mesh.triangles.size()));
}

/// Figure 7: at equal memory, fewer vertices against fewer bands. Those are fitted anew: the first bands of the higher
/// fit would be a third worse.
void measure_degrees(const std::string& model, int degree, int less) {
  const LitMesh lit = bronze_statue(model, degree), reduced = bronze_statue(model, less);
  tell("figure 7", "degree reduction", lit, reduced, 0);
  const std::size_t target = equal_memory(lit, reduced);
  tell_ours("figure 7", "ours, edge", lit, {.triangles = target});
  tell_ours("figure 7", "ours, half-edge", lit, {.triangles = target, .collapse = Collapse::half_edge});
}

/// Diffuse stripes on a specular sphere: of a paint of their own, or of one that sends the same mean colour.
LitMesh striped_sphere(bool one_mean) {
  Threads threads;
  LitMesh lit{.mesh = cube_sphere(50), .field = {}};
  const Coat diffuse{.roughness = 1, .f0 = {}, .albedo = {0.5F, 0.4F, 0.3F}};
  const Coat specular{.roughness = 0.3, .f0 = {0.4F, 0.4F, 0.4F}, .albedo = {0.3F, 0.2F, 0.1F}};
  const auto stripe = [](const Vec3f& p) {
    return std::clamp(0.5F + 4 * std::sin(25 * (p.x + 0.3F * p.y)), 0.0F, 1.0F);
  };
  lit.field = shine(lit.mesh, 4, one_mean ? specular : diffuse, specular, stripe, threads);
  if (!one_mean) return lit;
  const std::vector<Vec3f> mean = mean_radiance(lit.field, lit.mesh.normal);
  const std::size_t count = lit.field.count();
  for (std::size_t v = 0; v < mean.size(); ++v) {
    const float share = stripe(lit.mesh.position[v]);
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t i = 0; i < count; ++i) lit.field.of(v)[c * count + i] *= share;
      lit.field.of(v)[c * count] += (1 - share) * mean[v][c] / 0.28209479F;
    }
  }
  return lit;
}

/// Figure 8.
void measure_stripes() {
  for (const bool one_mean : {false, true}) {
    const LitMesh lit = striped_sphere(one_mean);
    for (const Collapse how : {Collapse::half_edge, Collapse::edge})
      measure_against_colours(one_mean ? "figure 8, one mean colour" : "figure 8, two paints", lit, 0.5, how);
  }
}

LitMesh veined(const std::string& model) {
  Threads threads;
  LitMesh lit{.mesh = load_model(model), .field = {}};
  lit.field = bake_colours(lit.mesh, threads);
  for (std::size_t v = 0; v < lit.mesh.position.size(); ++v) {
    const Vec3f albedo = veins(lit.mesh.position[v]).albedo;
    for (std::size_t c = 0; c < 3; ++c) lit.field.of(v)[c] *= albedo[c];
  }
  return lit;
}

/// Figure 9: diffuse veins.
void measure_diffuse(const std::string& model) {
  const LitMesh lit = veined(model);
  for (const double ratio : {0.25, 0.015})
    for (const Collapse how : {Collapse::half_edge, Collapse::edge})
      measure_against_colours("figure 9", lit, ratio, how);
}

/// At the weight of the tables that is best for light.
LitMesh best_colour_qem(const LitMesh& lit, std::size_t triangles, Collapse how) {
  LitMesh best;
  double least = HUGE_VAL;
  for (const double weight : {0.01, 0.03, 0.1, 0.3, 1.0}) {
    LitMesh found = simplify_colour_qem(lit, triangles, how, weight);
    const double error = compare(lit, found).light;
    if (error < least) least = error, best = std::move(found);
  }
  return best;
}

/// The paper's three comparisons as pictures.
bool draw_figures(const std::string& models, const std::string& folder) {
  Threads threads;
  const auto ours = [&](const LitMesh& lit, std::size_t triangles, Collapse how) {
    return simplify(lit, {.triangles = triangles, .collapse = how}, threads).lit;
  };
  const LitMesh statue = bronze_statue(models + "/scenes/buddha/buddha.glb", 8),
                fewer_bands = bronze_statue(models + "/scenes/buddha/buddha.glb", 3);
  const LitMesh fewer_vertices = ours(statue, equal_memory(statue, fewer_bands), Collapse::edge);
  bool written = write_figure(folder + "/figure7.jpg", {statue, fewer_vertices, fewer_bands},
                              {.back = {0.3, -1, 0.15}, .up = {0, 0, 1}, .height = 420, .scale = 0.5}, threads);
  const LitMesh stripes = striped_sphere(true);
  const std::size_t half = stripes.mesh.triangles.size() / 2;
  written &= write_figure(
      folder + "/figure8.jpg",
      {stripes, ours(stripes, half, Collapse::half_edge), best_colour_qem(stripes, half, Collapse::half_edge)},
      {.back = {0.3, 0.5, 1}, .height = 190, .scale = 0.2}, threads);
  const LitMesh skull = veined(models + "/scenes/skull/skull.glb");
  const std::size_t few = skull.mesh.triangles.size() * 15 / 1000;
  written &= write_figure(folder + "/figure9.jpg",
                          {skull, ours(skull, few, Collapse::edge), best_colour_qem(skull, few, Collapse::edge)},
                          {.back = {0.5, 0.2, 1}, .height = 260, .scale = 0.5}, threads);
  return written;
}

/// A light field as it was baked, with its materials' seams.
bool measure_carried(const std::string& path, double ratio) {
  const auto files = read_scene_files(path);
  auto carried = files ? import_carried_scene(*files) : tl::make_unexpected(files.error());
  if (!carried) return std::fprintf(stderr, "%s: %s\n", path.c_str(), carried.error().message.c_str()), false;
  const LitMesh lit{std::move(carried->scene.mesh), std::move(carried->field)};
  const auto target = static_cast<std::size_t>(ratio * static_cast<double>(lit.mesh.triangles.size()));
  tell_ours("carried", "ours, edge", lit, {.triangles = target});
  return true;
}

/// The tables of core/lightfield/README.md but for a million vertices, whose memory is measured alone.
void measure_all(const std::string& models) {
  for (const int degree : {0, 2, 4, 6, 8}) measure_distance(degree);
  for (const int degree : {0, 2, 4, 6, 8}) measure_candidate(degree);
  const std::string bunny = models + "/scenes/bunny/bun_zipper.ply";
  measure_colours(bunny, {17'400, 4'200, 1'000});
  measure_degrees(models + "/scenes/buddha/buddha.glb", 8, 3);
  measure_degrees(bunny, 6, 2);
  measure_stripes();
  measure_diffuse(models + "/scenes/skull/skull.glb");
  measure_scale(100'000, 4, 0.25);
}

int main_of(int argc, char** argv) {
  const std::string what = argc > 2 ? argv[1] : "";
  if (what == "all") {
    measure_all(argv[2]);
  } else if (what == "scale") {
    const auto number = [&](int i, double absent) { return argc > i ? std::stod(argv[i]) : absent; };
    measure_scale(static_cast<std::uint32_t>(number(2, 1e5)), static_cast<int>(number(3, 4)), number(4, 0.25));
  } else if (what == "carried") {
    return measure_carried(argv[2], argc > 3 ? std::stod(argv[3]) : 0.25) ? 0 : 1;
  } else if (what == "figures" && argc == 4) {
    return draw_figures(argv[2], argv[3]) ? 0 : 1;
  } else {
    return std::fprintf(stderr,
                        "kiln_light_field all MODELS | carried FILE [RATIO] | scale VERTICES [DEGREE] [RATIO] | "
                        "figures MODELS FOLDER\n"),
           2;
  }
  return 0;
}

}  // namespace
}  // namespace kiln::bench

int main(int argc, char** argv) { return kiln::bench::main_of(argc, argv); }
