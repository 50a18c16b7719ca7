// Radiosity at vertices: relRMSE against the shared references for processor seconds. One JSON line a run: the
// meshless rows, the paper's own scheme on the same points, core/prt's vertices (direct light of lamps, then its
// Neumann series), and the plain path estimator.
//   kiln_radiosity [scene: cornell | bunny | all] [repeats] [method: rows | paper | vertices | paths | all]
//   kiln_radiosity table: the paper's tables 1 and 2 of our scenes, in Markdown

#include "core/meshless/radiosity.h"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>

#include "core/meshless/link_builder.h"
#include "core/meshless/paper_bounces.h"
#include "core/prt/interreflection.h"
#include "core/prt/ray_origin.h"
#include "core/sphere/sh.h"
#include "core/trace/reference.h"
#include "tests/bench/bench.h"
#include "tests/core/prt/reference_set.h"

namespace kiln::bench {
namespace {

struct Case {
  std::string name, reference;
  testing::ReferenceSet set;
  std::optional<Environment> sky;
  std::vector<Vec3f> truth, direct;
};

/// Processor seconds by stage of the last run, and of all runs in all.
struct Clock {
  std::map<std::string, double> stages;
  std::string now;
  double since = process_seconds(), start = process_seconds();
  void begin(std::string_view name) {
    const double t = process_seconds();
    if (!now.empty()) stages[now] += t - since;
    now = name, since = t;
  }
};

void print(const Case& c, const std::string& method, const std::string& knobs, std::vector<double> seconds,
           const std::vector<Vec3f>& values, const std::string& more = "") {
  std::vector<Vec3f> compared;
  for (const std::uint32_t v : c.set.vertex) compared.push_back(values[v]);
  const testing::RelativeError error = testing::relative_error(compared, c.truth);
  std::printf(
      "{\"bench\":\"radiosity\",\"scene\":\"%s\",\"method\":\"%s\",\"knobs\":\"%s\",\"cpu_s\":%.3f,"
      "\"relrmse\":%.5f,\"without_worst_1pct\":%.5f%s}\n",
      c.name.c_str(), method.c_str(), knobs.c_str(), median(std::move(seconds)), error.all, error.without_worst,
      more.c_str());
  std::fflush(stdout);
}

/// relRMSE, and without the worst 1 %, of values at vertices.
std::string error_text(const Case& c, const std::vector<Vec3f>& values, const std::vector<Vec3f>& truth) {
  std::vector<Vec3f> compared;
  for (const std::uint32_t v : c.set.vertex) compared.push_back(values[v]);
  const testing::RelativeError error = testing::relative_error(compared, truth);
  char text[64];
  std::snprintf(text, sizeof text, "[%.5f,%.5f]", error.all, error.without_worst);
  return text;
}

std::string list(const std::vector<std::uint32_t>& numbers) {
  std::string text = "[";
  for (const std::uint32_t n : numbers) text += (text.size() > 1 ? "," : "") + std::to_string(n);
  return text + "]";
}

void run_points(const Case& c, const std::string& knobs, const Radiosity& params, int repeats, Threads& threads) {
  std::vector<double> seconds;
  std::vector<Vec3f> values;
  std::string more;
  for (int i = 0; i < repeats; ++i) {
    Clock clock;
    const Tracer tracer(c.set.scene, threads);
    Radiosity own = params;
    own.stage = [&](std::string_view name) { clock.begin(name); };
    RadiosityResult r = solve_radiosity(tracer, c.sky ? &*c.sky : nullptr, own, threads);
    clock.begin("end");
    seconds.push_back(process_seconds() - clock.start);
    more = ",\"direct\":" + error_text(c, r.direct, c.direct);
    values = std::move(r.direct);
    for (std::size_t v = 0; v < values.size(); ++v) values[v] += r.indirect[v];
    more += ",\"points\":" + list(r.stats.points) + ",\"gathered\":" + list(r.stats.gathered) +
            ",\"alone\":" + std::to_string(r.stats.alone) + ",\"sweeps\":" + std::to_string(r.stats.sweeps) +
            ",\"direct_rays\":" + std::to_string(r.stats.direct_rays) +
            ",\"gather_rays\":" + std::to_string(r.stats.gather_rays);
    for (const auto& [name, s] : clock.stages) {
      char text[64];
      std::snprintf(text, sizeof text, ",\"%s_s\":%.3f", name.c_str(), s);
      more += text;
    }
  }
  print(c, params.paper ? "paper" : "rows", knobs, seconds, values, more);
}

void run_vertices(const Case& c, int lamp_samples, int bounce_samples, int repeats, Threads& threads) {
  std::vector<double> seconds;
  std::vector<Vec3f> values;
  const std::vector<Vec3f> light = c.sky ? project_environment(*c.sky, 1) : std::vector<Vec3f>(1, Vec3f{});
  for (int i = 0; i < repeats; ++i) {
    const double start = process_seconds();
    const Tracer tracer(c.set.scene, threads);
    const std::vector<TransferPoint> points = vertex_points(c.set.scene.mesh);
    std::vector<float> direct(points.size(), 0.0F);
    std::vector<Vec3f> fixed;
    if (c.sky) {
      direct = bake_direct_transfer(tracer, points, {.order = 1, .samples = lamp_samples}, threads);
    } else {
      fixed = bake_fixed_direct(tracer, points, {.samples = lamp_samples}, threads);
    }
    const Interreflection params{.order = 1, .bounces = c.sky ? 5 : 10, .samples = bounce_samples};
    const Transfer t =
        bake_interreflection(tracer, c.set.scene.mesh, std::move(direct), std::move(fixed), params, threads);
    seconds.push_back(process_seconds() - start);
    values.assign(points.size(), {});
    for (std::size_t v = 0; v < points.size(); ++v) {
      for (std::size_t k = 0; k < 3; ++k) {
        const float* row = t.at(v, static_cast<int>(k));
        values[v][k] = row[0] * light[0][k] + (t.fixed ? row[t.slots() - 1] : 0.0F);
      }
    }
  }
  print(c, "vertices", "lamp " + std::to_string(lamp_samples) + " bounce " + std::to_string(bounce_samples), seconds,
        values);
}

void run_paths(const Case& c, int samples, Threads& threads) {
  const double start = process_seconds();
  const Tracer tracer(c.set.scene, threads);
  const std::vector<TransferPoint> points = vertex_points(c.set.scene.mesh);
  std::vector<ReferencePoint> places;
  for (const std::uint32_t v : c.set.vertex) {
    const TransferPoint& p = points[v];
    // The estimator lifts its rays itself; the hair inside the face is what keeps a vertex from looking through a wall.
    places.push_back({ray_origin(p), p.normal, p.face_normal});
  }
  ReferenceLight light;
  if (c.sky) light.environments = {*c.sky};
  light.scene_lights = !c.sky;
  const ReferenceResult r = trace_reference(tracer, places, light, {.samples = samples}, threads);
  const double seconds = process_seconds() - start;
  std::vector<Vec3f> values(points.size());
  for (std::size_t i = 0; i < c.set.vertex.size(); ++i) values[c.set.vertex[i]] = to_float(r.value[i]);
  print(c, "paths", "samples " + std::to_string(samples), {seconds}, values);
}

/// The model on the floor of a closed room four times as wide, under a lamp in the ceiling.
Scene in_a_room(Scene scene) {
  Vec3f least = scene.mesh.position.at(0), most = least;
  for (const Vec3f& p : scene.mesh.position)
    for (std::size_t k = 0; k < 3; ++k) least[k] = std::min(least[k], p[k]), most[k] = std::max(most[k], p[k]);
  const Vec3f size = most - least, middle = (least + most) * 0.5F;
  const float wide = 2 * std::max({size.x, size.y, size.z});
  const Vec3f low{middle.x - wide, least.y - 1e-4F * wide, middle.z - wide},
      high{middle.x + wide, least.y + 1.5F * wide, middle.z + wide};
  const auto add_quad = [&](int part, const Vec3f& corner, const Vec3f& a, const Vec3f& b) {
    Mesh& m = scene.mesh;
    const auto first = static_cast<std::uint32_t>(m.position.size());
    for (const Vec3f& p : {corner, corner + a, corner + a + b, corner + b}) {
      m.position.push_back(p), m.normal.push_back(normalized(cross(a, b)));
    }
    m.uv0.resize(m.uv0.empty() ? 0 : m.position.size()), m.uv1.resize(m.uv1.empty() ? 0 : m.position.size());
    m.color.resize(m.color.empty() ? 0 : m.position.size(), {1, 1, 1, 1});
    m.tangent.resize(m.tangent.empty() ? 0 : m.position.size(), {1, 0, 0, 1});
    m.triangles.push_back({first, first + 1, first + 2}), m.triangles.push_back({first, first + 2, first + 3});
    m.part.insert(m.part.end(), 2, static_cast<std::uint32_t>(part));
  };
  const auto add_part = [&](const Material& material) {
    scene.materials.push_back(material);
    scene.parts.push_back({.name = material.name, .material = static_cast<int>(scene.materials.size()) - 1});
    return static_cast<int>(scene.parts.size()) - 1;
  };
  const int walls = add_part({.name = "walls", .base_color = {0.7F, 0.7F, 0.7F, 1}, .metallic = 0}),
            lamp = add_part(
                {.name = "lamp", .base_color = {0.7F, 0.7F, 0.7F, 1}, .metallic = 0, .emission = {10, 10, 10}});
  const Vec3f x{high.x - low.x, 0, 0}, y{0, high.y - low.y, 0}, z{0, 0, high.z - low.z};
  add_quad(walls, low, z, x), add_quad(walls, low + y, x, z);
  add_quad(walls, low, x, y), add_quad(walls, low + z, y, x);
  add_quad(walls, low, y, z), add_quad(walls, low + x, z, y);
  add_quad(lamp, low + y * 0.999F + (x + z) * 0.4F, x * 0.2F, z * 0.2F);
  // Back into the unit cube.
  const float side = std::max({x.x, y.y, z.z});
  for (Vec3f& p : scene.mesh.position) p = (p - (low + high) * 0.5F) / side;
  return scene;
}

double peak_megabytes() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  return static_cast<double>(used.ru_maxrss) / 1024;
}

std::uint64_t sum_of(const std::vector<std::uint32_t>& numbers) {
  std::uint64_t sum = 0;
  for (const std::uint32_t n : numbers) sum += n;
  return sum;
}

/// A process of its own, so that its memory is that of this scene.
template <class F>
void apart(const F& work) {
  std::fflush(stdout);
  const pid_t child = fork();
  if (child == 0) {
    work();
    std::fflush(stdout);
    _exit(0);
  }
  int status = 0;
  if (child > 0) waitpid(child, &status, 0);
  if (child < 0 || status != 0) std::printf("| did not end (%d) |\n", status);
}

void table_row(const std::string& name, const Scene& scene, const Environment* sky) {
  Threads threads(2);
  Clock clock;
  clock.begin("tracer");
  const Tracer tracer(scene, threads);
  const RadiosityResult r =
      solve_radiosity(tracer, sky, {.stage = [&](std::string_view stage) { clock.begin(stage); }}, threads);
  clock.begin("end");
  const auto& s = clock.stages;
  const auto of = [&](const char* stage) { return s.contains(stage) ? s.at(stage) : 0; };
  std::printf("| %s | %zu | %llu, %llu | %.1f M, %.1f M | %zu | %.0f | %.2f, %.2f, %.2f | %.2f | %.2f |\n",
              name.c_str(), scene.mesh.triangles.size(), static_cast<unsigned long long>(sum_of(r.stats.points)),
              static_cast<unsigned long long>(sum_of(r.stats.gathered)), double(r.stats.direct_rays) / 1e6,
              double(r.stats.gather_rays) / 1e6, r.stats.points.size(), peak_megabytes(), of("points"), of("basis"),
              of("reading") + of("sweeps"), of("gather") + of("direct"), process_seconds() - clock.start);
}

void links_row(const std::string& name, const Scene& scene) {
  Threads threads(2);
  const double start = process_seconds();
  const Tracer tracer(scene, threads);
  LinkBuilder builder(tracer, {}, threads);
  const LightLinks links = builder.finish(scene.mesh, threads);
  const double bytes = double(links.links.size() * 8 + links.samples.size() * 16 + links.rows() * 24);
  std::printf("| %s | %u, %zu | %.1f M | %.2f M, %.2f %% | %.1f | %.0f | %.1f |\n", name.c_str(), links.senders,
              links.rows() - links.senders, double(builder.stats().rays) / 1e6, double(links.links.size()) / 1e6,
              100 * links.share_of_possible(), bytes / 1e6, peak_megabytes(), process_seconds() - start);
}

int print_table() {
  struct Row {
    std::string name, path;
    bool sky, room;
  };
  const std::vector<Row> rows{
      {"Cornell box of the references", "references/cornell.glb", false, false},
      {"dungeon, its lamps and a clear sky", "scenes/dungeon-interior/level-dungeon.gltf", true, false},
      {"hotel room, clear sky", "scenes/hotel-room/scene.glb", true, false},
      {"buddha in a room", "scenes/buddha/buddha.glb", false, true}};
  const auto for_each = [&](const auto& print) {
    for (const Row& row : rows) {
      apart([&] {
        auto scene = testing::load_scene(KILN_SHARED, row.path);
        if (!scene) return std::printf("| %s | is not there |\n", row.name.c_str()), void();
        if (row.room) scene = in_a_room(std::move(*scene));
        print(row, *scene);
      });
    }
  };
  std::printf(
      "| radiosity, default | triangles | points placed, gathered at | rays: direct, gathers | levels | peak MB | s: "
      "points, basis, reading and sweeps | s: rays | s: all |\n|---|---|---|---|---|---|---|---|---|\n");
  const Environment sky = clear_sky_with_sun();
  for_each([&](const Row& row, const Scene& scene) { table_row(row.name, scene, row.sky ? &sky : nullptr); });
  std::printf(
      "\n| transport, default | senders, receivers | rays | links, of possible | MB | peak MB | s "
      "|\n|---|---|---|---|---|---|---|\n");
  for_each([](const Row& row, const Scene& scene) { links_row(row.name, scene); });
  return 0;
}

std::vector<Case> load(const std::string& only) {
  std::vector<Case> out;
  for (const std::string name : {"cornell", "bunny"}) {
    if (only != "all" && only != name) continue;
    auto set = testing::load_reference_set(KILN_SHARED, name);
    if (!set) {
      std::fprintf(stderr, "%s is not there\n", name.c_str());
      continue;
    }
    std::vector<Vec3f> truth = set->values(name + ".comb"), direct = set->values(name + ".dir");
    std::optional<Environment> sky;
    if (name == "bunny") sky = constant_sky({1, 1, 1});
    out.push_back({name, name + ".comb", std::move(*set), sky, std::move(truth), std::move(direct)});
  }
  return out;
}

}  // namespace
}  // namespace kiln::bench

int main(int argc, char** argv) {
  using namespace kiln;
  using namespace kiln::bench;
  const std::string scene = argc > 1 ? argv[1] : "all", method = argc > 3 ? argv[3] : "all";
  const int repeats = argc > 2 ? std::max(1, std::atoi(argv[2])) : 1;
  if (scene == "table") return print_table();
  Threads threads(2);
  for (const Case& c : load(scene)) {
    const auto rows = [&](const std::string& knobs, const Radiosity& r) { run_points(c, knobs, r, repeats, threads); };
    if (method == "rows" || method == "all") {
      const LampRays few{16, 64}, many{64, 512};
      rows("draft", {.points = {.wanted = 4096}, .direct = {few, 64}, .rays = 128, .eps = 0.05F});
      rows("256 rays, eps .05", {.rays = 256, .eps = 0.05F});
      rows("default", {});
      rows("scalar", {.vector = false});
      rows("all gathered", {.uniform_levels = 5});
      rows("final", {.points = {.wanted = 60000}, .direct = {many, 1024}, .rays = 1024, .eps = 0.01F});
    }
    if (method == "paper" || method == "all") {
      const float omega = kPaperSolidAngle;
      rows("eps .05, 128 rays", {.points = {.levels = 4}, .rays = 128, .eps = 0.05F, .paper = omega});
      rows("eps .04, 512 rays", {.points = {.levels = 4}, .eps = 0.04F, .paper = omega});
      rows("eps .02, 512 rays", {.points = {.levels = 4}, .eps = 0.02F, .paper = omega});
    }
    if (method == "vertices" || method == "all") {
      run_vertices(c, 64, 64, repeats, threads);
      run_vertices(c, 256, 256, repeats, threads);
    }
    if (method == "paths" || method == "all") {
      run_paths(c, 16, threads);
      run_paths(c, 64, threads);
    }
  }
}
