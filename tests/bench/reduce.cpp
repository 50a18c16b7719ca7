// Reduction: how fast, in how much memory, how far off.
//   kiln_reduce write OUT.(ply|glb) TRIANGLES           a torus with relief of many scales, written as a stream
//   kiln_reduce run FILE TRIANGLES [METHOD] [MEMORY_MB] [MAP]     METHOD cluster or adaptive; MAP texels, 0 none, -1
//   auto kiln_reduce compare FILE TRIANGLES                  the same file by ours (whole, clustered, adaptive) and by
//   others
#include "core/reduce/reduce.h"

#include <meshoptimizer.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <string>

#include "core/artifact/triangle_stream.h"
#include "core/reduce/clusters.h"
#include "core/reduce/collapse.h"
#include "core/reduce/collect.h"
#include "tests/bench/bench.h"
#include "tests/bench/reduce_rivals.h"

namespace kiln::bench {
namespace {

/// A torus of n x 2 n squares whose radius is disturbed by sines of many lengths: closed, and rough wherever it is
/// seen.
Vec3f torus_point(std::uint64_t i, std::uint64_t k, std::uint64_t n) {
  constexpr double kTurn = 6.283185307179586;
  const double u = kTurn * static_cast<double>(k) / static_cast<double>(2 * n);
  const double v = kTurn * static_cast<double>(i) / static_cast<double>(n);
  double relief = 0;
  for (int octave = 0; octave < 6; ++octave) {
    const double f = 5 * std::pow(2.0, octave);
    relief += std::sin(std::round(f) * u + 1.3 * octave) * std::cos(std::round(0.6 * f) * v) / f;
  }
  const double r = 0.4 + 0.12 * relief, ring = 1 + r * std::cos(v);
  return to_float(Vec3d{ring * std::cos(u), ring * std::sin(u), r * std::sin(v)});
}

template <class T>
void put(std::string& out, const T& x) {
  out.append(reinterpret_cast<const char*>(&x), sizeof x);
}

/// Calls for all vertices, then all triangles of the torus.
template <class Vertex, class Face>
void torus(std::uint64_t n, const Vertex& vertex, const Face& face) {
  for (std::uint64_t i = 0; i < n; ++i) {
    for (std::uint64_t k = 0; k < 2 * n; ++k) vertex(torus_point(i, k, n));
  }
  const auto at = [&](std::uint64_t i, std::uint64_t k) {
    return static_cast<std::uint32_t>(i % n * 2 * n + k % (2 * n));
  };
  for (std::uint64_t i = 0; i < n; ++i) {
    for (std::uint64_t k = 0; k < 2 * n; ++k) {
      face(at(i, k), at(i, k + 1), at(i + 1, k + 1));
      face(at(i, k), at(i + 1, k + 1), at(i + 1, k));
    }
  }
}

int write_model(const std::string& path, std::uint64_t triangles) {
  const auto n = static_cast<std::uint64_t>(std::lround(std::sqrt(static_cast<double>(triangles) / 4)));
  const std::uint64_t vertices = 2 * n * n, faces = 4 * n * n;
  const bool glb = path.size() > 4 && path.substr(path.size() - 4) == ".glb";
  std::ofstream file(path, std::ios::binary);
  std::string out;
  if (glb) {
    const std::uint64_t binary = 12 * vertices + 12 * faces;
    const auto number = [](std::uint64_t x) { return std::to_string(x); };
    std::string json =
        R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
        R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"buffers":[{"byteLength":)" +
        number(binary) + R"(}],"bufferViews":[{"buffer":0,"byteLength":)" + number(12 * vertices) +
        R"(},{"buffer":0,"byteOffset":)" + number(12 * vertices) + R"(,"byteLength":)" + number(12 * faces) +
        R"(}],"accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":)" + number(vertices) +
        R"(,"min":[-2,-2,-2],"max":[2,2,2]},{"bufferView":1,"componentType":5125,"type":"SCALAR","count":)" +
        number(3 * faces) + "}]}";
    while (json.size() % 4 != 0) json += ' ';
    for (const std::uint64_t word : {std::uint64_t{0x46546C67}, std::uint64_t{2}, 28 + json.size() + binary,
                                     json.size(), std::uint64_t{0x4E4F534A}})
      put(out, static_cast<std::uint32_t>(word));
    out += json;
    put(out, static_cast<std::uint32_t>(binary));
    put(out, std::uint32_t{0x004E4942});
  } else {
    out = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(vertices) +
          "\nproperty float x\nproperty float y\nproperty float z\nelement face " + std::to_string(faces) +
          "\nproperty list uchar int vertex_indices\nend_header\n";
  }
  const auto flush = [&] {
    if (out.size() < (1U << 20)) return;
    file << out;
    out.clear();
  };
  torus(
      n, [&](const Vec3f& p) { put(out, p), flush(); },
      [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        if (!glb) out += '\3';
        for (const std::uint32_t v : {a, b, c}) put(out, v);
        flush();
      });
  file << out;
  std::printf(R"({"bench":"write","triangles":%llu,"bytes":%lld})"
              "\n",
              static_cast<unsigned long long>(faces), static_cast<long long>(file.tellp()));
  return file ? 0 : 1;
}

TriangleSource open(const std::string& path, std::uint64_t memory_mb) {
  Findings findings(path);
  SceneFiles files{.name = path};
  files.main = *FileBytes::map(path, path);
  TriangleSource source =
      open_triangles(files, {.spill_folder = "/tmp", .max_memory_bytes = memory_mb << 20}, findings);
  if (findings.failed())
    std::fprintf(stderr, "%s: %s\n", findings.fault().where.c_str(), findings.fault().message.c_str());
  return source;
}

int run(const std::string& path, const Reduce& asked) {
  const TriangleSource source = open(path, asked.memory_bytes >> 20);
  if (!source.stream) return 1;
  const auto plan = plan_reduction(source, asked);
  if (!plan) return std::fprintf(stderr, "%s\n", plan.error().message.c_str()), 1;
  std::vector<std::pair<std::string, double>> stages;
  Reduce params = asked;
  params.begin = [&](const std::string& stage, double) { stages.emplace_back(stage, wall_seconds()); };
  Threads threads;
  const double start = wall_seconds(), before = process_seconds();
  const auto reduced = reduce(source, *plan, params, threads);
  if (!reduced) return std::fprintf(stderr, "%s\n", reduced.error().message.c_str()), 1;
  const double end = wall_seconds();
  stages.emplace_back("end", end);
  const auto n = static_cast<double>(reduced->input_triangles);
  std::printf(R"({"bench":"run","input":%.0f,"clustered":%llu,"triangles":%zu,"charts":%zu,"side":%d,"filled":%.3f,)"
              R"("seconds":%.2f,"cpu_seconds":%.2f,"predicted_seconds":%.2f,"own_mb":%.0f,"predicted_mb":%.0f,)"
              R"("rms_percent":%.5f,"back_percent":%.5f,"most_percent":%.4f,"most_back_percent":%.4f,"beyond":%llu,)"
              R"("normal_degrees":%.2f,"plain_degrees":%.2f,"stages":{)",
              n, static_cast<unsigned long long>(reduced->clustered_triangles), reduced->mesh.triangles.size(),
              reduced->charts, reduced->maps.side, reduced->maps.filled, end - start, process_seconds() - before,
              plan->seconds, static_cast<double>(reduced->own_memory_bytes) / 1e6,
              static_cast<double>(plan->memory_bytes) / 1e6, 100 * reduced->error.rms, 100 * reduced->error.rms_back,
              100 * reduced->error.most, 100 * reduced->error.most_back,
              static_cast<unsigned long long>(reduced->error.beyond), reduced->normal_degrees,
              reduced->plain_normal_degrees);
  for (std::size_t i = 0; i + 1 < stages.size(); ++i) {
    const double seconds = stages[i + 1].second - stages[i].second;
    std::printf("%s\"%s\":[%.2f,%.2f]", i ? "," : "", stages[i].first.c_str(), seconds, n / seconds / 1e6);
  }
  std::printf("}}\n");
  return 0;
}

void tell(const char* name, Surface surface, const TriangleSource& source, const Extent& extent, double seconds,
          Threads& threads) {
  const Mesh mesh = delivered_mesh(surface, nullptr, false);
  const UnitFrame frame = extent.frame();
  const Projecting what{.mesh = mesh,
                        .atlas = nullptr,
                        .frame = frame,
                        .diagonal = length(extent.high - extent.low) / frame.scale,
                        .triangles = extent.triangles};
  const auto projection = project(source, what, threads);
  if (!projection) return;
  const GeometricError& e = projection->error;
  std::printf(R"({"bench":"compare","by":"%s","triangles":%zu,"seconds":%.3f,"rms_percent":%.5f,"back_percent":%.5f,)"
              R"("both_percent":%.5f,"most_percent":%.4f,"beyond":%llu,"normal_degrees":%.2f})"
              "\n",
              name, mesh.triangles.size(), seconds, 100 * e.rms, 100 * e.rms_back,
              100 * std::sqrt(0.5 * (e.rms * e.rms + e.rms_back * e.rms_back)), 100 * std::max(e.most, e.most_back),
              static_cast<unsigned long long>(e.beyond), normal_error(mesh, nullptr, projection->probes));
  std::fflush(stdout);
}

void simplify_meshopt(Surface& s, std::size_t triangles) {
  std::vector<float> positions;
  for (const Vec3d& p : s.position) {
    for (std::size_t a = 0; a < 3; ++a) positions.push_back(static_cast<float>(p[a]));
  }
  std::vector<unsigned> indices;
  for (const Triangle& t : s.triangles) indices.insert(indices.end(), t.begin(), t.end());
  std::vector<unsigned> out(indices.size());
  out.resize(meshopt_simplify(out.data(), indices.data(), indices.size(), positions.data(), s.position.size(), 12,
                              3 * triangles, 1e9F, 0, nullptr));
  s.triangles.clear();
  for (std::size_t i = 0; i + 2 < out.size(); i += 3) s.triangles.push_back({out[i], out[i + 1], out[i + 2]});
  drop_unused(s);
}

int compare(const std::string& path, std::size_t triangles) {
  Threads threads;
  const TriangleSource source = open(path, 4096);
  if (!source.stream) return 1;
  const auto extent = measure(source, threads);
  const auto whole = collect(source, *extent, threads);
  if (!extent || !whole) return 1;
  const auto timed = [&](const char* name, const auto& make) {
    const double start = thread_seconds();
    Surface s = make();
    const double seconds = thread_seconds() - start;
    tell(name, std::move(s), source, *extent, seconds, threads);
  };
  timed("ours, whole", [&] {
    Surface s = *whole;
    collapse(s, triangles, threads);
    return s;
  });
  for (const double factor : {8.0, 4.0, 2.0}) {
    const auto vertices = static_cast<std::uint64_t>(factor * static_cast<double>(triangles) / 2);
    const std::string times = " x" + std::to_string(static_cast<int>(factor));
    timed(("ours, clustered" + times).c_str(), [&] {
      Surface s = *cluster(source, *extent, {.cells = vertices}, threads);
      collapse(s, triangles, threads);
      return s;
    });
    timed(("ours, adaptive" + times).c_str(), [&] {
      Surface s = *cluster(source, *extent, {.cells = 4 * vertices, .vertices = vertices}, threads);
      collapse(s, triangles, threads);
      return s;
    });
  }
  timed("clusters alone", [&] { return *cluster(source, *extent, {.cells = triangles / 2}, threads); });
  timed("meshoptimizer", [&] {
    Surface s = *whole;
    simplify_meshopt(s, triangles);
    return s;
  });
#ifdef KILN_OPENMESH
  timed("openmesh", [&] {
    Surface s = *whole;
    simplify_openmesh(s, triangles);
    return s;
  });
#endif
  return 0;
}

int main_of(int argc, char** argv) {
  const std::string what = argc > 3 ? argv[1] : "";
  const auto number = [&](int i, std::int64_t absent) { return argc > i ? std::stoll(argv[i]) : absent; };
  if (what == "write") return write_model(argv[2], static_cast<std::uint64_t>(number(3, 0)));
  if (what == "compare") return compare(argv[2], static_cast<std::size_t>(number(3, 0)));
  if (what != "run") return std::fprintf(stderr, "kiln_reduce write|run|compare FILE TRIANGLES\n"), 2;
  Reduce params{.triangles = static_cast<std::uint64_t>(number(3, 0))};
  if (argc > 4 && std::strcmp(argv[4], "cluster") == 0) params.method = ReduceMethod::cluster;
  params.memory_bytes = static_cast<std::uint64_t>(number(5, 512)) << 20;
  params.map_side = static_cast<int>(number(6, -1));
  return run(argv[2], params);
}

}  // namespace
}  // namespace kiln::bench

int main(int argc, char** argv) { return kiln::bench::main_of(argc, argv); }
